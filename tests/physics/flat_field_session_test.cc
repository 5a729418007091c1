// From flats of a bench to the irradiance of a lamp: what a captured flat field mends on a
// reflector rig whose vignetting and pixels nobody has calibrated otherwise. The figures of
// docs/performance.md.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/capture/take/capture_sensor.h"
#include "luxfield/reconstruct/calibrate/sensor/flat_field.h"
#include "luxfield/reconstruct/merge/merge_session.h"
#include "tests/core/chi_squared.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

// A fifth of the light lost in the corners, pixels that differ by 1 %; the session holds neither.
constexpr const char* kErrors =
    "[errors.vignetting]\ncorner_loss = 0.2\ncalibrated = false\n[errors.prnu]\nrms = 0.01\n"
    "[errors.dark_current]\ne_per_s = 5\n";

// Camera and screen in their places; `delta_m` from the filter, behind which a square lamp shines.
std::string Bench(double delta_m, double side_m, double radiance, bool ideal) {
  return fmt::format(
             "[lab]\ndriver = \"sim\"\nseed = 9\nideal = {}\n[rig]\nkind = \"reflector\"\n"
             "albedo = 0.95\ndelta_m = {}\n[filter]\nspacing_m = 0.033\n[lamp]\nkind = \"square\"\n"
             "side_m = {}\nradiance = {}\n[camera]\nwidth = 120\nheight = 96\n"
             "corners_m = [-0.36, 0.36,  0.40, 0.34,  0.38, -0.36,  -0.35, -0.34]\n"
             "responsivity_e_per_s_per_w_m2 = [1200]\n",
             ideal, delta_m, side_m, radiance) +
         planning::kCameraCodes + planning::kStage + planning::kCameraNoise + kErrors;
}

// The screen evenly lit from the filter's side: by a lamp 50 m away, to 1e-4.
reconstruct::FlatField MeasureFlats(const std::filesystem::path& folder) {
  hal::Devices devices = planning::DevicesOf(Bench(50, 1, 1.5e8, false));
  capture::RunSensorCapture(
      capture::ReadSensorPlan(core::Config::FromString(
          "[plan]\nkind = \"sensor\"\n[exposure]\nmin_s = 0.01\nmax_s = 1.6\nlevels = 14\n",
          "plan.toml")),
      devices, folder);
  const session::SessionReader session(folder);
  const auto field = reconstruct::MeasureFlatField(session, {});
  EXPECT_EQ(field.provenance.at("session_plan"), session.plan_id());
  return field;
}

constexpr const char* kLampPlan = R"(
[plan]
unit = "W"
dark_repeats = 2
[rig]
kind = "reflector"
albedo = 0.95
delta_m = 0.3
[filter]
spacing_m = 0.033
[grid]
width = 2
height = 2
[lattice]
width = 30
height = 30
ds_m = 0.0165
[exposure]
min_s = 0.001
max_s = 4
[reference]
every = 0
[warm_up]
window_s = 10
)";

struct Error {
  double relative = 0, chi_squared = 0, texels = 0;  // relative: RMS over RMS; chi^2 per texel
};

Error Compare(const lightfield::Measurements& measured, const lightfield::Measurements& truth) {
  Error error;
  double square = 0, off = 0;
  for (std::size_t m = 0; m < truth.positions.size(); ++m)
    for (std::size_t k = 0; k < truth.positions[m].mask.size(); ++k) {
      if (measured.positions[m].mask[k] & lightfield::kUnknownMask) continue;
      const double e = truth.positions[m].irradiance[k],
                   d = measured.positions[m].irradiance[k] - e;
      off += d * d;
      square += e * e;
      error.chi_squared += std::pow(d / measured.positions[m].sigma[k], 2);
      ++error.texels;
    }
  error.relative = std::sqrt(off / square);
  error.chi_squared /= error.texels;
  return error;
}

TEST(FlatFieldSession, MendsTheIrradianceOfAnUncalibratedReflectorBench) {
  const ScratchFolder folder("flat_field_session");
  const auto field = MeasureFlats(folder.path() / "flats");
  EXPECT_TRUE(field.measured);
  EXPECT_NEAR(field.pattern, 0.01, 5e-4);
  const auto file = folder.path() / "bench.flat.exr";
  reconstruct::WriteFlatField(file, field);

  const planning::LabSession ideal("flat_field_ideal", Bench(0.3, 0.1, 6e4, true), kLampPlan),
      lab("flat_field_lab", Bench(0.3, 0.1, 6e4, false), kLampPlan);
  const auto truth = reconstruct::MergeSession(ideal.Read());
  const session::SessionReader session = lab.Read();
  reconstruct::MergeSessionOptions options;
  const Error stated = Compare(reconstruct::MergeSession(session, options), truth);
  options.flat_field = file;
  const Error flat = Compare(reconstruct::MergeSession(session, options), truth);
  std::printf(
      "E of an uncalibrated reflector bench: %.3f %% off without a flat field (chi^2 %.1f), "
      "%.4f %% with one of %d flats (chi^2 %.3f of %.0f texels)\n",
      100 * stated.relative, stated.chi_squared, 100 * flat.relative, field.flats, flat.chi_squared,
      flat.texels);
  EXPECT_GT(stated.relative, 0.02);
  EXPECT_LT(flat.relative, 0.1 * stated.relative);  // noise
  // Four positions share the pixels and with them the map's errors, and texels beside one another
  // share pixels: an eighth of them is independent.
  EXPECT_GT(flat.chi_squared, ChiSquaredShare(flat.texels / 8, -kRareZ));
  EXPECT_LT(flat.chi_squared, ChiSquaredShare(flat.texels / 8, kRareZ));
}

}  // namespace
}  // namespace luxfield::planning
