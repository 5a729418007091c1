// Exposure times found from a session's frames, on a simulated lab whose shutter opens too long.
#include "reconstruct/session_exposures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "capture/capture.h"
#include "core/progress.h"
#include "hal/sim/simulated_lab.h"
#include "reconstruct/merge_session.h"

namespace luxfield::study {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLab = R"(
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[lamp]
kind = "square"
side_m = 0.03
depth_m = 0.05
radiance = 1e7
[camera]
width = 96
height = 96
pitch_m = 0.004
bits = 14
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
responsivity_e_per_s_per_w_m2 = [1200]
min_exposure_s = 1e-4
max_exposure_s = 100
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = 0.05
settle_s = 0.5
[errors.photon_noise]
[errors.read_noise]
rms_dn = 1.6
)";

constexpr const char* kPlan = R"(
[plan]
unit = "lm"
dark_repeats = 4
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[grid]
width = 3
height = 3
[lattice]
width = 20
height = 20
ds_m = 0.016
[exposure]
min_s = 0.001
max_s = 4.2
floor_sigmas = 100
[reference]
every = 0
[warm_up]
window_s = 10
)";

fs::path Capture(const std::string& name, const std::string& errors, bool ideal) {
  core::Progress::SetQuiet(true);
  core::SetInterruptCountForTest(0);
  const fs::path folder = fs::path(testing::TempDir()) / ("luxfield_session_exposures_" + name);
  fs::remove_all(folder);
  const std::string lab =
      std::string("[lab]\ndriver = \"sim\"\nseed = 12\nideal = ") + (ideal ? "true" : "false");
  hal::Devices devices =
      hal::sim::SimulatedLab(core::Config::FromString(lab + kLab + errors, "lab.toml"))
          .MakeDevices();
  capture::RunCapture(capture::ReadPlan(core::Config::FromString(kPlan, "plan.toml")), devices,
                      folder);
  return folder;
}

struct Pulls {
  double mean = 0, rms = 0, relative = 0;  // relative: root mean square of the relative deviation
};

Pulls Compare(const lightfield::Measurements& m, const lightfield::Measurements& truth) {
  Pulls pulls;
  double n = 0;
  for (std::size_t k = 0; k < m.positions.size(); ++k)
    for (std::size_t p = 0; p < m.positions[k].mask.size(); ++p) {
      if (m.positions[k].mask[p] || truth.positions[k].mask[p]) continue;
      const double off = m.positions[k].irradiance[p] - truth.positions[k].irradiance[p],
                   pull = off / m.positions[k].sigma[p];
      pulls.mean += pull;
      pulls.rms += pull * pull;
      pulls.relative += std::pow(off / truth.positions[k].irradiance[p], 2);
      ++n;
    }
  return {pulls.mean / n, std::sqrt(pulls.rms / n), std::sqrt(pulls.relative / n)};
}

TEST(SessionExposures, FindsAShutterThatOpensTooLong) {
  constexpr double kOffset_s = 5e-5;
  const fs::path truth_folder = Capture("truth", "", true),
                 folder = Capture("offset", "[errors.shutter]\noffset_s = 5e-5\n", false);
  const auto truth = reconstruct::MergeSession(core::SessionReader(truth_folder));
  const core::SessionReader session(folder);
  reconstruct::MergeSessionOptions options;
  const Pulls stated = Compare(reconstruct::MergeSession(session, options), truth);
  options.estimate_exposures = true;
  reconstruct::MergeSessionSummary summary;
  const Pulls estimated = Compare(reconstruct::MergeSession(session, options, &summary), truth);
  std::printf("relative error of E: as stated %.4f %%, estimated %.4f %% (pulls %.2f, %.2f)\n",
              100 * stated.relative, 100 * estimated.relative, stated.rms, estimated.rms);
  const double longest_s = summary.exposures.front().exposure_s;
  double chi_squared = 0, degrees = 0;
  for (const auto& rung : summary.exposures) {
    const double expected = (1 + kOffset_s / rung.exposure_s) / (1 + kOffset_s / longest_s);
    std::printf("  %10.6g s: ratio %.6f +- %.6f, true %.6f%s\n", rung.exposure_s, rung.ratio.value,
                rung.ratio.sigma, expected, rung.known ? "" : " (unknown)");
    if (!rung.known || rung.ratio.sigma == 0) continue;
    chi_squared += std::pow((rung.ratio.value - expected) / rung.ratio.sigma, 2);
    ++degrees;
  }
  ASSERT_GE(degrees, 4);
  EXPECT_LT(chi_squared, degrees + 5 * std::sqrt(2 * degrees));
  EXPECT_GT(stated.relative, 2 * estimated.relative);
  EXPECT_GT(stated.rms, 1.5);
  EXPECT_LT(estimated.rms, 1.15);
  fs::remove_all(folder);
  fs::remove_all(truth_folder);
}

TEST(SessionExposures, StandardErrorsKnowWhatFramesOfOneRungScatter) {
  // A jitter of 2e-5 s, 2 % of the shortest exposure: far above the noise of the pixels.
  const fs::path folder = Capture("jitter", "[errors.shutter]\njitter_s = 2e-5\n", false);
  reconstruct::MergeSessionOptions options;
  options.estimate_exposures = true;
  reconstruct::MergeSessionSummary summary;
  reconstruct::MergeSession(core::SessionReader(folder), options, &summary);
  const auto& shortest = summary.exposures.back();
  ASSERT_TRUE(shortest.known);
  EXPECT_NEAR(shortest.ratio.value, 1, 4 * shortest.ratio.sigma);
  // Nine frames of it at most.
  EXPECT_GT(shortest.ratio.sigma * shortest.exposure_s, 2e-5 / 3 / 3);
  EXPECT_LT(shortest.ratio.sigma * shortest.exposure_s, 2e-5);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace luxfield::study
