// A camera with a colour mosaic against the same one behind a colour wheel, in simulated labs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

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
responsivity_e_per_s_per_w_m2 = [900, 1200, 700]
)" + camera +
         planning::kCameraCodes + planning::kStage + planning::kCameraNoise + R"([sampling]
u_per_cell = 16
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

TEST(Mosaic, AgreesWithAColourWheelUpToItsResolution) {
  const planning::LabSession colour_wheel("mosaic_wheel", Lab("", true), kPlan),
      bayer("mosaic_bayer", Lab("cfa = \"GRBG\"\n", true), kPlan);
  const session::SessionReader session = bayer.Read();
  for (const session::FrameRecord& record : session.frames()) EXPECT_EQ(record.channel, 0);
  const auto wheel = reconstruct::MergeSession(colour_wheel.Read()),
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
}

TEST(Mosaic, StatesItsNoise) {
  const planning::LabSession noisy_lab("mosaic_noisy", Lab("cfa = \"RGGB\"\n", false), kPlan),
      ideal_lab("mosaic_noiseless", Lab("cfa = \"RGGB\"\n", true), kPlan);
  const session::SessionReader session = noisy_lab.Read();
  const auto noisy = reconstruct::MergeSession(session),
             truth = reconstruct::MergeSession(ideal_lab.Read());
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
}

}  // namespace
}  // namespace luxfield::planning
