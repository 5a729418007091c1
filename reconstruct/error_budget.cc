#include "reconstruct/error_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/colour.h"
#include "core/error.h"
#include "reconstruct/adjoint_solve.h"
#include "reconstruct/basis_truncation.h"
#include "reconstruct/calibrate_glare.h"
#include "reconstruct/error_propagation.h"
#include "reconstruct/filter_noise.h"
#include "reconstruct/filter_system.h"
#include "reconstruct/geometry_calibration_file.h"
#include "reconstruct/geometry_uncertainty.h"
#include "reconstruct/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec3;
using lightfield::Weights;

constexpr std::array<const char*, kErrorSources> kNames = {
    "photon noise", "read noise",   "PRNU",        "shutter",     "lamp drift", "monitor",
    "stage",        "image shift",  "geometry",    "print shift", "density",    "density gamma",
    "grain",        "filter noise", "stray light", "light meter"};

struct Asked {
  std::string name, unit;
  double value = 0;
  Weights weights;
  std::optional<double> truncation;
  double per_delta = 0;  // dQ per metre of the plane distance, coefficients as they are
};

double PerDelta(const LightField& field,
                const std::function<Weights(const LuminaireGeometry&)>& weights) {
  constexpr double kStep = 1e-4;  // relative; the error of a central difference is its square
  LuminaireGeometry above = field.geometry, below = field.geometry;
  above.delta_m *= 1 + kStep;
  below.delta_m *= 1 - kStep;
  return (Apply(weights(above), field) - Apply(weights(below), field)) /
         (above.delta_m - below.delta_m);
}

std::string RadianceUnit(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kWatt:
      return "W/(sr m^2)";
    case lightfield::FluxUnit::kLumen:
      return "cd/m^2";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "relative";
}

std::string IrradianceUnit(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kWatt:
      return "W/m^2";
    case lightfield::FluxUnit::kLumen:
      return "lx";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "relative";
}

// The ray through the middle of the largest coefficient, and two receivers on the axis.
void AskWhatIsUsual(const LightField& field, BudgetSettings* settings) {
  const LuminaireGeometry& g = field.geometry;
  const auto largest = static_cast<std::size_t>(
      std::max_element(field.data.begin(), field.data.end()) - field.data.begin());
  const auto texel = static_cast<int>(largest % g.plane_size());
  const auto m = static_cast<int>(largest / (g.plane_size() * g.channels));
  settings->rays.push_back({"radiance at the largest coefficient",
                            g.grid.centre(m % g.grid.width, m / g.grid.width),
                            g.lattice.centre(texel / g.lattice.width, texel % g.lattice.width)});
  for (const double distance_m : {1.0, 10.0})
    settings->receivers.push_back({fmt::format("irradiance on the axis at {} m", distance_m),
                                   {0, 0, g.delta_m + distance_m},
                                   {0, 0, -1}});
}

// Root mean square over 5 x 5 rays within a spacing on F: one ray may lie where the two happen to
// agree.
double RayTruncation(const LightField& fine, const LightField& coarse, const RayAsked& ray) {
  constexpr int kHalf = 2;
  double sum = 0;
  for (int y = -kHalf; y <= kHalf; ++y)
    for (int x = -kHalf; x <= kHalf; ++x) {
      const double step_m = fine.geometry.grid.spacing_m / kHalf;
      const auto u = ray.u_m + step_m * lightfield::Vec2{1.0 * x, 1.0 * y};
      const double off = core::Luminance(Radiance(fine, u, ray.s_m)) -
                         core::Luminance(Radiance(coarse, u, ray.s_m));
      sum += off * off;
    }
  return std::sqrt(sum) / (2 * kHalf + 1);
}

std::vector<Asked> Ask(const LightField& field, BudgetSettings settings) {
  if (settings.rays.empty() && settings.receivers.empty()) AskWhatIsUsual(field, &settings);
  const LuminaireGeometry& g = field.geometry;
  std::vector<Asked> quantities;
  const auto ask = [&](const std::string& name, const std::string& unit, auto&& weights) {
    Asked& q = quantities.emplace_back(Asked{name, unit, 0, weights(g), {}});
    q.value = Apply(q.weights, field);
    q.per_delta = PerDelta(field, weights);
  };
  ask("flux", lightfield::FluxUnitName(g.unit), lightfield::FluxWeights);
  for (const RayAsked& ray : settings.rays)
    ask(ray.name, RadianceUnit(g.unit), [&](const LuminaireGeometry& geometry) {
      return RadianceWeights(geometry, ray.u_m, ray.s_m);
    });
  for (const ReceiverAsked& at : settings.receivers)
    ask(at.name, IrradianceUnit(g.unit), [&](const LuminaireGeometry& geometry) {
      return IrradianceWeights(geometry, at.p_m, at.normal);
    });
  if (const auto coarse = Coarsened(field)) {
    for (Asked& q : quantities) q.truncation = std::abs(q.value - Apply(q.weights, *coarse));
    for (std::size_t n = 0; n < settings.rays.size(); ++n)
      quantities[1 + n].truncation = RayTruncation(field, *coarse, settings.rays[n]);
  }
  return quantities;
}

// Multiplies all quantities by the factor the meter asks for, as linear forms: what factor and
// quantity have in common cancels. Returns the factor, whose weights are those of its own error.
struct Scaled {
  Asked factor;
  double meter_relative = 0;
  MeterScale scale;
};

Scaled ScaleByMeter(const LightField& field, const Meter& meter, std::vector<Asked>* quantities) {
  Scaled result;
  double numerator = 0, denominator = 0;
  std::vector<Weights> weights;
  std::vector<double> values, per_delta;
  for (const MeterReading& reading : meter.readings) {
    const auto at = [&](const LuminaireGeometry& geometry) {
      return IrradianceWeights(geometry, reading.at.p_m, reading.at.normal);
    };
    weights.push_back(at(field.geometry));
    values.push_back(Apply(weights.back(), field));
    per_delta.push_back(PerDelta(field, at));
    const double a = 1 / (reading.sigma * reading.sigma), e = values.back();
    if (!(e > 0))
      throw InputError(
          fmt::format("the meter's reading '{}' is {}, but the session shows no light "
                      "there; correct its place",
                      reading.at.name, reading.value));
    numerator += a * reading.value * e;
    denominator += a * e * e;
  }
  const double factor = numerator / denominator;
  // d log(factor) per dE: -a E / sum a E^2 where R = factor E.
  Weights common(field.data.size(), 0.0);
  double common_per_delta = 0;
  for (std::size_t n = 0; n < weights.size(); ++n) {
    const MeterReading& reading = meter.readings[n];
    const double share = values[n] / (reading.sigma * reading.sigma * denominator);
    for (std::size_t k = 0; k < common.size(); ++k) common[k] += share * weights[n][k];
    common_per_delta += share * per_delta[n];
    const double residual = reading.value / (factor * values[n]) - 1;
    result.scale.residuals.push_back(residual);
    const double by_sigma = (reading.value - factor * values[n]) / reading.sigma;
    result.scale.chi_squared += by_sigma * by_sigma;
  }
  result.scale.degrees = static_cast<int>(values.size()) - 1;
  result.meter_relative = std::hypot(meter.calibration, 1 / (factor * std::sqrt(denominator)));
  for (Asked& q : *quantities) {
    for (std::size_t k = 0; k < common.size(); ++k)
      q.weights[k] = factor * (q.weights[k] - q.value * common[k]);
    q.per_delta = factor * (q.per_delta - q.value * common_per_delta);
    q.value *= factor;
    if (q.truncation) *q.truncation *= factor;
  }
  for (double& w : common) w *= -factor;
  result.factor = {"scale factor", "", factor, std::move(common), {}, -factor * common_per_delta};
  return result;
}

// Of every quantity; nothing where the geometry is as the session states it.
std::optional<std::vector<double>> GeometrySigmas(const MergeSessionOptions& how,
                                                  const lightfield::Measurements& measurements,
                                                  const LightField& field,
                                                  const std::vector<Asked>& quantities,
                                                  const std::vector<Weights>& weights) {
  const auto file =
      std::find_if(how.calibrations.begin(), how.calibrations.end(), IsGeometryCalibration);
  if (file == how.calibrations.end()) return {};
  const GeometryUncertainty geometry(*file);
  const PrintSensitivity print(field.geometry.grid.basis, field.geometry.grid.spacing_m,
                               measurements.filter_scale);
  std::vector<double> sigmas;
  for (std::size_t q = 0; q < quantities.size(); ++q)
    sigmas.push_back(std::sqrt(GeometryVariance(geometry, measurements, field, weights[q], print,
                                                quantities[q].per_delta)));
  return sigmas;
}

// What settings leave open and calibrations say: the veiling glare as stray light.
ErrorSizes KnownSizes(const BudgetSettings& settings, const MergeSessionOptions& how,
                      const SensorModel& sensor) {
  ErrorSizes sizes = settings.sizes;
  for (const std::filesystem::path& path : how.calibrations)
    if (!sizes.stray_share && IsGlareCalibration(path))
      sizes.stray_share = std::abs(ReadGlareCalibration(path, sensor).share);
  return sizes;
}

// The sizes of the print's errors, with those of its measurement.
ErrorSizes WithFilter(ErrorSizes sizes, const lightfield::MeasuredFilter& filter) {
  sizes.print_shift_m = std::hypot(sizes.print_shift_m.value_or(0), filter.position_sigma_m);
  sizes.density = std::hypot(sizes.density.value_or(0), filter.level_sigma);
  sizes.density_gamma = sizes.density_gamma.value_or(0);
  sizes.grain = sizes.grain.value_or(0);
  return sizes;
}

// At the planned places, as all sensitivities are.
FilterSystem SystemOf(const lightfield::BasisGrid& grid, const lightfield::MeasuredFilter& filter) {
  std::vector<lightfield::Vec2> centres;
  for (int m = 0; m < grid.count(); ++m)
    centres.push_back(grid.centre(m % grid.width, m / grid.width));
  return FilterSystem(grid, &filter, centres);
}

double FilterNoise(const LightField& field, const lightfield::MeasuredFilter& filter,
                   const Weights& weights) {
  LagSums lags;
  for (int m = 0; m < field.geometry.grid.count(); ++m) lags += SumLags(field, weights, m);
  return std::sqrt(FilterNoiseVariance(filter, lags));
}

}  // namespace

const char* ErrorSourceName(ErrorSource source) { return kNames[static_cast<std::size_t>(source)]; }

double QuantityBudget::Total() const {
  double sum = 0;
  for (const auto& s : sigma) sum += s.value_or(0) * s.value_or(0);
  return std::sqrt(sum);
}

ErrorBudget ComputeErrorBudget(const core::SessionReader& session, const BudgetSettings& settings,
                               const MergeSessionOptions& how,
                               const lightfield::MeasuredFilter* filter) {
  const SessionPlan plan = CalibratedPlan(session, how);
  const auto measurements = MergeSession(session, how);
  ReconstructOptions in_double;
  in_double.precision = Precision::kDouble;
  in_double.filter = filter;
  const LightField field = Reconstruct(measurements, in_double).coefficients;

  std::vector<Asked> quantities = Ask(field, settings);
  std::optional<Scaled> scaled;
  if (settings.meter) {
    scaled = ScaleByMeter(field, *settings.meter, &quantities);
    quantities.push_back(std::move(scaled->factor));
  }
  std::optional<FilterSystem> system;
  if (filter) system.emplace(SystemOf(field.geometry.grid, *filter));
  std::vector<Weights> weights;
  std::vector<double> filter_noise;
  for (const Asked& q : quantities) {
    weights.push_back(AdjointSolve(measurements, q.weights, system ? &*system : nullptr));
    if (filter) filter_noise.push_back(FilterNoise(field, *filter, weights.back()));
  }
  const auto by_geometry = GeometrySigmas(how, measurements, field, quantities, weights);
  ErrorPropagation propagation({session, plan, how, measurements, field}, std::move(weights));
  MergeSessionOptions observed = how;
  observed.observer = &propagation;
  observed.check_hashes = false;
  MergeSession(session, observed);

  ErrorSizes sizes = KnownSizes(settings, how, plan.sensor);
  if (filter) sizes = WithFilter(sizes, *filter);
  ErrorBudget budget;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    QuantityBudget& result = budget.quantities.emplace_back();
    result.name = quantities[q].name;
    result.unit = quantities[q].unit;
    result.value = quantities[q].value;
    result.truncation = quantities[q].truncation;
    result.sigma = propagation.Sigma(q, sizes);
    if (filter) result.sigma[static_cast<std::size_t>(ErrorSource::kFilterNoise)] = filter_noise[q];
    if (by_geometry)
      result.sigma[static_cast<std::size_t>(ErrorSource::kGeometry)] = (*by_geometry)[q];
    if (scaled)
      result.sigma[static_cast<std::size_t>(ErrorSource::kMeter)] =
          scaled->meter_relative * std::abs(result.value);
  }
  if (scaled) {
    scaled->scale.factor = std::move(budget.quantities.back());
    budget.quantities.pop_back();
    budget.scale = std::move(scaled->scale);
  }
  return budget;
}

namespace {

nlohmann::json ToJson(const QuantityBudget& quantity) {
  nlohmann::json sources;
  for (int s = 0; s < kErrorSources; ++s) {
    const auto& sigma = quantity.sigma[static_cast<std::size_t>(s)];
    sources[kNames[static_cast<std::size_t>(s)]] =
        sigma ? nlohmann::json(*sigma) : nlohmann::json();
  }
  const double total = quantity.Total();
  return {
      {"name", quantity.name},
      {"unit", quantity.unit},
      {"value", quantity.value},
      {"sigma", total},
      {"relative", quantity.value != 0 ? total / std::abs(quantity.value) : 0},
      {"truncation", quantity.truncation ? nlohmann::json(*quantity.truncation) : nlohmann::json()},
      {"sources", sources}};
}

}  // namespace

nlohmann::json ToJson(const ErrorBudget& budget) {
  nlohmann::json quantities = nlohmann::json::array();
  for (const QuantityBudget& quantity : budget.quantities) quantities.push_back(ToJson(quantity));
  nlohmann::json json{{"quantities", quantities}};
  if (budget.scale)
    json["scale"] = {{"factor", ToJson(budget.scale->factor)},
                     {"residuals", budget.scale->residuals},
                     {"chi_squared", budget.scale->chi_squared},
                     {"degrees", budget.scale->degrees}};
  return json;
}

}  // namespace luxfield::reconstruct
