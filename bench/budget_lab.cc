#include "luxfield/bench/budget_lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/reconstruct/budget/error_budget.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"

namespace luxfield::bench {
namespace {

constexpr double kDelta_m = 0.3, kSpacing_m = 0.03, kPixel_m = 0.01;
constexpr int kSensor = 32;
// The simulated grain: bilinear between knots, unit variance; the integral of its autocorrelation
// is (3/2)^2 knots.
constexpr double kGrainArea = 2.25;

bool IsTotal(const std::string& source) { return source == kTotal || source == kScaledTotal; }

constexpr const char* kRig = R"([rig]
kind = "lensless"
delta_m = 0.3
[filter]
spacing_m = 0.03
)";
constexpr const char* kSingle = R"(kind = "basis"
basis = "bspline2"
scale = 1.7777777777777777
)";
constexpr const char* kDual = R"(kind = "dual"
basis = "quadratic"
)";

constexpr const char* kLab = R"([lab]
driver = "sim"
name = "error budget"
seed = 1
{}
[lamp]
kind = "lightfield"
file = "lamp.lf.exr"
[camera]
width = 32
height = 32
pitch_m = 0.01
bits = 16
black_dn = 1000
saturation_dn = 64000
gain_dn_per_e = 0.64
responsivity_e_per_s_per_w_m2 = [2000]
min_exposure_s = 1e-4
max_exposure_s = 10
readout_s = 0.05
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = 0.05
settle_s = 0.5
[sampling]
u_per_cell = 12
[errors.photon_noise]
[errors.read_noise]
rms_dn = 40
[errors.dark_current]
e_per_s = 100
[errors.prnu]
rms = 0.01
[errors.shutter]
jitter_s = 2e-5
time_s = 5e-5
[errors.drift]
amplitude = 0.02
period_s = 25
[errors.monitor_noise]
relative = 0.003
[errors.stage]
repeatability_m = 1e-4
[errors.registration]
shift_m = [2e-4, 2e-4]
[errors.density]
relative = 0.005
gamma = 0.01
grain = 0.05
grain_size_m = 0.005
[errors.stray_light]
share = 0.003
)";

constexpr const char* kPlan = R"([plan]
name = "error budget"
unit = "lm"
channels = 1
dark_repeats = {}
{}
[grid]
width = {}
height = {}
[lattice]
width = 16
height = 16
ds_m = 0.015
[exposure]
min_s = 0.004
max_s = 0.3
ratio = 4
relevant_share = 0.05
floor_sigmas = {}
mean_tolerance = 0.2
[reference]
every = 3
max_drift = 0.5
[warm_up]
window_s = 5
interval_s = 1
variation = 0.5
)";

// All of the geometry but the lattice.
lightfield::LuminaireGeometry Planes(bool dual, int filters) {
  using lightfield::BasisKind;
  lightfield::LuminaireGeometry g;
  g.delta_m = kDelta_m;
  g.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(dual ? BasisKind::kQuadratic : BasisKind::kBspline2), filters,
      filters, kSpacing_m);
  g.unit = lightfield::FluxUnit::kLumen;
  return g;
}

// Broad bumps, each image its own, and no symmetry that would hide an error. Three by three.
lightfield::LightField Lamp(lightfield::LuminaireGeometry g) {
  constexpr int kSize = 44;
  g.lattice = {kSize, kSize, -0.5 * kSize * kPixel_m, 0.5 * kSize * kPixel_m, kPixel_m, kPixel_m};
  lightfield::LightField field(g);
  for (int m = 0; m < g.grid.count(); ++m) {
    const double x = 0.05 * (m % 3 - 1) + 0.02, y = 0.04 * (m / 3 - 1) - 0.03,
                 peak = 1e6 * (1 + 0.35 * ((m * 5) % 9));
    auto image = field.image(m, 0);
    for (std::size_t k = 0; k < image.size(); ++k) {
      const auto s = g.lattice.centre(static_cast<int>(k) / kSize, static_cast<int>(k) % kSize);
      const double r = std::hypot(s.x - x, s.y - y) / 0.08;
      image[k] = static_cast<float>(peak * (0.05 + std::exp(-0.5 * r * r)));
    }
  }
  return field;
}

}  // namespace

lightfield::LuminaireGeometry WriteBudgetLab(const std::filesystem::path& folder, bool dual,
                                             int filters, Ladder ladder) {
  std::filesystem::create_directories(folder);
  // Of so few pixels all brackets look at the same ones for the exposures' ratios, and would share
  // the noise of few dark frames; those of a camera look at others each.
  const auto [dark_repeats, floor_sigmas] =
      ladder == Ladder::kLong ? std::pair(16, 100) : std::pair(2, 5);
  const std::string rig = std::string(kRig) + (dual ? kDual : kSingle);
  core::WriteFileAtomically(folder / "lab.toml", fmt::format(kLab, rig));
  core::WriteFileAtomically(folder / "plan.toml",
                            fmt::format(kPlan, dark_repeats, rig, filters, filters, floor_sigmas));
  constexpr int kTexels = 6;  // 0.09 m and two spacings beside it are on the sensor
  constexpr double kTexel_m = 3 * kPixel_m;
  lightfield::LuminaireGeometry g = Planes(dual, filters);
  g.lattice = {kTexels,  kTexels, -0.5 * kTexels * kTexel_m, 0.5 * kTexels * kTexel_m,
               kTexel_m, kTexel_m};
  return g;
}

void WriteBudgetLab(const std::filesystem::path& folder, bool dual, Ladder ladder) {
  constexpr int kFilters = 3;
  WriteBudgetLab(folder, dual, kFilters, ladder);
  lightfield::WriteLightField(folder / "lamp.lf.exr", Lamp(Planes(dual, kFilters)));
}

void AskOfBudgetLab(reconstruct::BudgetSettings* settings) {
  settings->rays = {{"bright ray", {0.004, -0.007}, {0.0225, -0.0375}},
                    {"dim ray", {-0.041, 0.018}, {-0.0825, 0.0675}}};
  settings->receivers = {{"axis, 1 m", {0, 0, kDelta_m + 1}, {0, 0, -1}},
                         {"near, aside",
                          {0.08, 0.05, kDelta_m + 0.15},
                          lightfield::Normalized(lightfield::Vec3{-0.2, 0, -1})}};
}

std::vector<double> QuantitiesOf(const lightfield::LightField& field,
                                 const reconstruct::BudgetSettings& asked) {
  std::vector<double> values{TotalFlux(field)[0]};
  for (const auto& ray : asked.rays) values.push_back(Radiance(field, ray.u_m, ray.s_m)[0]);
  for (const auto& at : asked.receivers)
    values.push_back(ExactIrradiance(field, at.p_m, at.normal)[0]);
  return values;
}

nlohmann::json BudgetRow(const std::string& source, const std::string& quantity, int runs,
                         double value, double predicted, double observed) {
  return {{"source", source},
          {"quantity", quantity},
          {"runs", runs},
          {"value", value},
          {"predicted", predicted},
          {"observed", observed},
          {"ratio", predicted / observed},
          {"error", 1 / std::sqrt(2.0 * runs)},
          {"share", observed / std::abs(value)}};
}

reconstruct::ErrorSizes SizesOfLab(const std::filesystem::path& lab) {
  reconstruct::ErrorSizes sizes;
  const auto number = [&](const char* source, const char* key) {
    const auto values = planning::ReadLabNumbers(lab, source, key);
    double square = 0;
    for (const double v : values) square += v * v;
    return values.empty() ? 0 : std::sqrt(square / static_cast<double>(values.size()));
  };
  sizes.shutter_jitter_s = number("shutter", "jitter_s");
  sizes.exposure_time_s = number("shutter", "time_s");
  sizes.lamp_wander = number("drift", "amplitude") / std::numbers::sqrt2;
  sizes.lamp_wander_period_s = number("drift", "period_s");
  // A frame's figure is the mean of a reading before it and one after it.
  sizes.monitor = number("monitor_noise", "relative") / std::numbers::sqrt2;
  sizes.stage_m = number("stage", "repeatability_m");
  sizes.image_shift_m = kImageShift_m;
  sizes.print_shift_m = number("registration", "shift_m");
  sizes.density = number("density", "relative");
  sizes.density_gamma = number("density", "gamma");
  sizes.grain = number("density", "grain");
  const double grain_size_m = number("density", "grain_size_m");
  sizes.grain_area_m2 = kGrainArea * grain_size_m * grain_size_m;
  sizes.stray_share = number("stray_light", "share");
  return sizes;
}

reconstruct::Meter MeterOfBudgetLab() {
  reconstruct::Meter meter;
  meter.calibration = 0.01;
  for (const lightfield::Vec3 p : {lightfield::Vec3{0, 0, 1}, {0.3, 0.1, 1.2}, {-0.2, 0.2, 0.8}})
    meter.readings.push_back({{"", p, {0, 0, -1}}, 0, 0});
  return meter;
}

void ReadMeter(reconstruct::Meter* meter, const std::vector<double>& irradiance, std::uint64_t seed,
               int run) {
  core::Random random(seed, 0x6D65746572, static_cast<std::uint32_t>(run));
  const double calibration = meter->calibration * random.Normal();
  for (std::size_t n = 0; n < irradiance.size(); ++n) {
    reconstruct::MeterReading& reading = meter->readings[n];
    reading.sigma = 0.008 * irradiance[n];
    reading.value = irradiance[n] * (1 + calibration) + reading.sigma * random.Normal();
  }
}

std::vector<std::string> AllErrors() {
  return {"photon_noise",  "read_noise", "dark_current", "prnu",    "shutter",    "drift",
          "monitor_noise", "stage",      "registration", "density", "stray_light"};
}

std::vector<BudgetCase> BudgetCases() {
  using reconstruct::ErrorSource;
  using reconstruct::ErrorSourceName;
  const auto one = [](ErrorSource source, std::vector<std::string> enabled) {
    return BudgetCase{ErrorSourceName(source), std::move(enabled)};
  };
  const auto estimated = [](BudgetCase what) {
    what.estimated = true;
    return what;
  };
  const std::vector<std::string> all = AllErrors();
  return {one(ErrorSource::kPhotonNoise, {"photon_noise"}),
          one(ErrorSource::kReadNoise, {"read_noise", "dark_current"}),
          one(ErrorSource::kPrnu, {"prnu"}),
          one(ErrorSource::kShutter, {"shutter"}),
          one(ErrorSource::kExposureTimes, {"shutter"}),
          estimated({ErrorSourceName(ErrorSource::kExposureTimes),
                     {"photon_noise", "read_noise", "dark_current", "prnu"},
                     false,
                     true}),
          estimated({kTotal, all}),
          one(ErrorSource::kLampDrift, {"drift"}),
          one(ErrorSource::kMonitor, {"monitor_noise"}),
          one(ErrorSource::kStage, {"stage"}),
          {ErrorSourceName(ErrorSource::kImageShift), all, false, true},
          one(ErrorSource::kGeometry, {}),
          one(ErrorSource::kPrintShift, {"registration"}),
          one(ErrorSource::kDensity, {"density"}),
          one(ErrorSource::kDensityGamma, {"density"}),
          one(ErrorSource::kGrain, {"density"}),
          one(ErrorSource::kStrayLight, {"stray_light"}),
          {ErrorSourceName(ErrorSource::kMeter), {}, true},
          {kScaledTotal, all, true},
          {kTotal, all}};
}

std::string LabOf(const BudgetCase& what) {
  return (what.beside_others && !what.estimated) || IsTotal(what.name) ? kTotal : what.name;
}

void WriteGeometryOfRun(const std::filesystem::path& file, const reconstruct::ErrorSizes& sizes,
                        const std::string& source, std::uint64_t seed, int run) {
  using reconstruct::ErrorSource;
  const auto is = [&](ErrorSource of) {
    return IsTotal(source) || source == reconstruct::ErrorSourceName(of);
  };
  core::Random random(seed, 0x696D616765, static_cast<std::uint32_t>(run));
  const auto draw = [&](ErrorSource of) {
    const double normal = random.Normal();
    return is(of) ? normal : 0;
  };
  const double image_shift_m = sizes.image_shift_m.value_or(0);
  const double shift_s_m = image_shift_m * draw(ErrorSource::kImageShift),
               shift_t_m = image_shift_m * draw(ErrorSource::kImageShift);

  reconstruct::GeometryCalibration calibration;
  reconstruct::Geometry& g = calibration.geometry;
  g.parameters = {{"sensor_s", "m", 0, 4e-4},      {"sensor_t", "m", 0, 3e-4},
                  {"sensor_turn", "rad", 0, 4e-3}, {"delta", "m", kDelta_m, 1.5e-3},
                  {"stage_scale_u", "1", 1, 6e-3}, {"stage_scale_v", "1", 1, 5e-3},
                  {"stage_turn", "rad", 0, 5e-3},  {"stage_skew", "rad", 0, 6e-3}};
  constexpr double kOwn = 0.8, kNext = 0.6;
  const std::size_t count = g.parameters.size();
  std::vector<double> normal(count);
  for (double& z : normal) z = draw(ErrorSource::kGeometry);
  for (std::size_t r = 0; r < count; ++r)
    for (std::size_t c = 0; c < count; ++c) {
      const bool neighbours = (r + 1) % count == c || (c + 1) % count == r;
      g.covariance.push_back((r == c       ? 1
                              : neighbours ? kOwn * kNext
                                           : 0) *
                             g.parameters[r].sigma * g.parameters[c].sigma);
    }
  for (std::size_t k = 0; k < count; ++k)
    g.parameters[k].value +=
        g.parameters[k].sigma * (kOwn * normal[k] + kNext * normal[(k + 1) % count]);

  const auto value = [&](std::size_t k) { return g.parameters[k].value; };
  const double c = std::cos(value(2)), s = std::sin(value(2)), half = 0.5 * kSensor * kPixel_m;
  g.width = g.height = kSensor;
  g.image_from_sensor = {{kPixel_m * c, kPixel_m * s, value(0) + shift_s_m - half * (c + s),
                          kPixel_m * s, -kPixel_m * c, value(1) + shift_t_m - half * (s - c), 0, 0,
                          1}};
  g.delta_m = value(3);
  g.stage_axes = {
      {{value(4) * std::cos(value(6)), value(4) * std::sin(value(6)), 0},
       {-value(5) * std::sin(value(6) + value(7)), value(5) * std::cos(value(6) + value(7)), 0}}};
  reconstruct::WriteGeometryCalibration(file, calibration);
}

std::vector<planning::LabNumbers> DrawErrors(const reconstruct::ErrorSizes& sizes,
                                             const std::string& source, std::uint64_t seed,
                                             int run) {
  using reconstruct::ErrorSource;
  core::Random random(seed, 0x62756467, static_cast<std::uint32_t>(run));
  const auto draw = [&](ErrorSource of, const std::optional<double>& size) {
    const double normal = random.Normal();  // drawn in any case: the order of draws is fixed
    return IsTotal(source) || source == reconstruct::ErrorSourceName(of) ? normal * size.value_or(0)
                                                                         : 0;
  };
  const double dx = draw(ErrorSource::kPrintShift, sizes.print_shift_m),
               dy = draw(ErrorSource::kPrintShift, sizes.print_shift_m),
               density = draw(ErrorSource::kDensity, sizes.density),
               gamma = draw(ErrorSource::kDensityGamma, sizes.density_gamma),
               stray = draw(ErrorSource::kStrayLight, sizes.stray_share),
               sine = draw(ErrorSource::kLampDrift, sizes.lamp_wander),
               cosine = draw(ErrorSource::kLampDrift, sizes.lamp_wander);
  // Errors that the lab draws for itself, where they are switched on.
  const auto of_lab = [&](ErrorSource of, const std::optional<double>& size) {
    return IsTotal(source) || source == reconstruct::ErrorSourceName(of) ? size.value_or(0) : 0;
  };
  constexpr double kDegrees = 180 / std::numbers::pi, kLeastShare = 1e-9;
  return {{"registration", "shift_m", {dx, dy}},
          {"density", "relative", {density}},
          {"density", "gamma", {gamma}},
          {"density", "grain", {of_lab(ErrorSource::kGrain, sizes.grain)}},
          {"shutter", "jitter_s", {of_lab(ErrorSource::kShutter, sizes.shutter_jitter_s)}},
          {"shutter", "time_s", {of_lab(ErrorSource::kExposureTimes, sizes.exposure_time_s)}},
          {"stray_light", "share", {std::max(kLeastShare, std::abs(stray))}},
          {"drift", "amplitude", {std::hypot(sine, cosine)}},
          {"drift", "phase_deg", {std::atan2(cosine, sine) * kDegrees}}};
}

}  // namespace luxfield::bench
