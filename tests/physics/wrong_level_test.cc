// A camera whose longest exposures stay too dark: what was merged agrees with the truth within its
// standard deviations where capture flags such frames, and does not where they pass.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "luxfield/core/json.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/capture/capture_fixture.h"
#include "tests/capture/faulty_camera.h"

namespace luxfield::physics {
namespace {

using capture::FaultyCamera;

// Frames of more than four seconds show 0.8 of their light.
hal::Devices DevicesWithAStuckShutter(const hal::sim::TestLab& lab) {
  hal::Devices devices = hal::sim::SimulatedLab(lab.Config()).MakeDevices();
  devices.camera = std::make_unique<FaultyCamera>(
      std::move(devices.camera), [](int, hal::Frame& frame, const hal::Frame&) {
        if (frame.settings.exposure_s < 4) return;
        for (auto& dn : frame.image.dn)
          dn = static_cast<std::uint16_t>(std::lround(100 + 0.8 * (dn - 100)));
      });
  return devices;
}

struct Result {
  double chi_squared = 0, worst_pull = 0;  // per texel; the largest
  std::size_t texels = 0;
  capture::CaptureSummary capture;
  reconstruct::MergeSessionSummary merge;
};

Result MeasureWithTolerance(double mean_tolerance) {
  core::SetInterruptCountForTest(0);
  const hal::sim::TestLab lab = capture::Noisy();
  capture::Plan plan = capture::TestPlan();
  plan.exposure.ratio = 2;  // three frames or more in every bracket
  plan.exposure.max_s = 6;
  plan.exposure.relevant_share = 5e-4;
  plan.exposure.mean_tolerance = mean_tolerance;
  plan.reference.every = 0;  // whose exposures are long ones, too
  hal::Devices devices = DevicesWithAStuckShutter(lab);
  const auto folder = capture::NewFolder("wrong_level");
  Result result;
  result.capture = capture::RunCapture(plan, devices, folder);
  const auto measured =
      reconstruct::MergeSession(session::SessionReader(folder), {}, &result.merge);
  std::filesystem::remove_all(folder);
  const auto truth = hal::sim::SimulatedLab(lab.Config()).true_irradiance(measured.geometry);
  for (std::size_t m = 0; m < truth.size(); ++m) {
    const auto& position = measured.positions[m];
    for (std::size_t p = 0; p < truth[m].size(); ++p) {
      if (position.mask[p] & lightfield::kUnknownMask) continue;
      const double pull = (position.irradiance[p] - truth[m][p]) / position.sigma[p];
      result.chi_squared += pull * pull;
      result.worst_pull = std::max(result.worst_pull, std::abs(pull));
      ++result.texels;
    }
  }
  result.chi_squared /= static_cast<double>(result.texels);
  std::printf(
      "tolerance %g: %d frames flagged, %d left out; chi^2 %.3f a texel over %zu, worst "
      "pull %.2f\n",
      mean_tolerance, result.capture.flagged, result.merge.frames_left_out, result.chi_squared,
      result.texels, result.worst_pull);
  return result;
}

TEST(WrongLevel, IsOutsideSigmaUnlessItsFramesAreLeftOut) {
  const Result unseen = MeasureWithTolerance(1);
  EXPECT_EQ(unseen.capture.flagged, 0);
  EXPECT_GT(unseen.chi_squared, 50);

  const Result seen = MeasureWithTolerance(0.05);
  EXPECT_GT(seen.capture.flagged, 0);
  EXPECT_EQ(seen.merge.frames_left_out, seen.capture.flagged);
  EXPECT_EQ(seen.merge.missing_positions, 0);
  EXPECT_EQ(seen.texels, unseen.texels);
  EXPECT_NEAR(seen.chi_squared, 1, 4 * std::sqrt(2.0 / static_cast<double>(seen.texels)));
  EXPECT_LT(seen.worst_pull, 5);
}

}  // namespace
}  // namespace luxfield::physics
