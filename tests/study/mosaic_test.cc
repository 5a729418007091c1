// A camera with a colour mosaic against the same one behind a colour wheel, in simulated labs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "capture/capture.h"
#include "core/error.h"
#include "core/progress.h"
#include "hal/sim/simulated_lab.h"
#include "reconstruct/error_budget.h"
#include "reconstruct/merge_session.h"

namespace luxfield::study {
namespace {

namespace fs = std::filesystem;

std::string Lab(const std::string& camera, bool ideal) {
  return std::string("[lab]\ndriver = \"sim\"\nseed = 9\nchannels = 3\nideal = ") +
         (ideal ? "true" : "false") + R"(
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[lamp]
kind = "square"
side_m = 0.1
depth_m = 0.05
radiance = 1000
colour = [1, 0.7, 0.3]
[camera]
width = 96
height = 96
pitch_m = 0.004
bits = 14
black_dn = 400
saturation_dn = 16000
gain_dn_per_e = 0.16
responsivity_e_per_s_per_w_m2 = [900, 1200, 700]
min_exposure_s = 1e-4
max_exposure_s = 100
)" + camera +
         R"([stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = 0.05
settle_s = 0.5
[sampling]
u_per_cell = 16
[errors.photon_noise]
[errors.read_noise]
rms_dn = 1.6
[errors.vignetting]
corner_loss = 0.2
)";
}

constexpr const char* kPlan = R"(
[plan]
unit = "lm"
channels = 3
dark_repeats = 2
[rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
[grid]
width = 2
height = 2
[lattice]
width = 16
height = 16
ds_m = 0.016
[exposure]
min_s = 0.001
max_s = 16
[reference]
every = 4
[warm_up]
window_s = 10
)";

fs::path Capture(const std::string& name, const std::string& lab) {
  core::Progress::SetQuiet(true);
  core::SetInterruptCountForTest(0);
  const fs::path folder = fs::path(testing::TempDir()) / ("luxfield_mosaic_" + name);
  fs::remove_all(folder);
  hal::Devices devices =
      hal::sim::SimulatedLab(core::Config::FromString(lab, "lab.toml")).MakeDevices();
  capture::RunCapture(capture::ReadPlan(core::Config::FromString(kPlan, "plan.toml")), devices,
                      folder);
  EXPECT_TRUE(capture::VerifySession(folder).problems.empty());
  return folder;
}

TEST(Mosaic, AgreesWithAColourWheelUpToItsResolution) {
  const fs::path wheel_folder = Capture("wheel", Lab("", true));
  const fs::path mosaic_folder = Capture("bayer", Lab("cfa = \"GRBG\"\n", true));
  const core::SessionReader session(mosaic_folder);
  for (const core::FrameRecord& record : session.frames()) EXPECT_EQ(record.channel, 0);
  const auto wheel = reconstruct::MergeSession(core::SessionReader(wheel_folder)),
             mosaic = reconstruct::MergeSession(session);
  double sum = 0, squares = 0, total = 0, n = 0;
  for (std::size_t m = 0; m < wheel.positions.size(); ++m)
    for (std::size_t k = 0; k < wheel.positions[m].irradiance.size(); ++k) {
      ASSERT_EQ(mosaic.positions[m].mask[k % 256], wheel.positions[m].mask[k % 256]);
      const double e = wheel.positions[m].irradiance[k],
                   off = mosaic.positions[m].irradiance[k] - e;
      sum += off;
      squares += off * off;
      total += e;
      ++n;
    }
  const double rms = std::sqrt(squares / n) / (total / n);
  std::printf("mosaic against colour wheel: rms %.3f %%, bias %.4f %% of the mean E\n", 100 * rms,
              100 * sum / total);
  // What the light bends and steps (its u samples) within two pixels of a texel's four; half a
  // pixel of misplacement would be some 3 %.
  EXPECT_LT(rms, 5e-3);
  EXPECT_LT(std::abs(sum / total), 1e-3);
  fs::remove_all(wheel_folder);
  fs::remove_all(mosaic_folder);
}

TEST(Mosaic, StatesItsNoise) {
  const fs::path folder = Capture("noisy", Lab("cfa = \"RGGB\"\n", false)),
                 truth_folder = Capture("noiseless", Lab("cfa = \"RGGB\"\n", true));
  const core::SessionReader session(folder);
  const auto noisy = reconstruct::MergeSession(session),
             truth = reconstruct::MergeSession(core::SessionReader(truth_folder));
  double chi_squared = 0, degrees = 0;
  for (std::size_t m = 0; m < noisy.positions.size(); ++m)
    for (std::size_t k = 0; k < noisy.positions[m].irradiance.size(); ++k) {
      if (noisy.positions[m].mask[k % 256] & lightfield::kUnknownMask) continue;
      chi_squared +=
          std::pow((noisy.positions[m].irradiance[k] - truth.positions[m].irradiance[k]) /
                       noisy.positions[m].sigma[k],
                   2);
      ++degrees;
    }
  // Texels share the pixels that their borders cut, which widens the sum's scatter a little; dark
  // frames and references are common to positions. 6 standard deviations.
  EXPECT_NEAR(chi_squared / degrees, 1, 6 * std::sqrt(2 / degrees));
  EXPECT_THROW(reconstruct::ComputeErrorBudget(session, {}), InputError);
  fs::remove_all(folder);
  fs::remove_all(truth_folder);
}

}  // namespace
}  // namespace luxfield::study
