#include "luxfield/reconstruct/budget/error_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/budget/budget_quantities.h"
#include "luxfield/reconstruct/budget/coarser_grids.h"
#include "luxfield/reconstruct/budget/error_budget_json.h"
#include "luxfield/reconstruct/budget/error_propagation.h"
#include "luxfield/reconstruct/budget/filter_noise.h"
#include "luxfield/reconstruct/budget/geometry_uncertainty.h"
#include "luxfield/reconstruct/budget/missing_positions.h"
#include "luxfield/reconstruct/calibrate/geometry/geometry_calibration_file.h"
#include "luxfield/reconstruct/calibrate/glare/calibrate_glare.h"
#include "luxfield/reconstruct/merge/tilt_effect_json.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LightField;
using lightfield::Weights;

constexpr std::array<const char*, kErrorSources> kNames = {
    "photon noise",  "read noise",     "PRNU",
    "shutter",       "exposure times", "lamp drift",
    "monitor",       "stage",          "image shift",
    "geometry",      "print shift",    "density",
    "density gamma", "grain",          "filter noise",
    "stray light",   "light meter",    "missing positions",
    "basis"};

// Of every quantity; nothing where the geometry is as the session states it.
std::optional<std::vector<double>> GeometrySigmas(const MergeSessionOptions& how,
                                                  const lightfield::Measurements& measurements,
                                                  const LightField& field,
                                                  const std::vector<AskedQuantity>& quantities,
                                                  const std::vector<Weights>& weights) {
  const auto file =
      std::find_if(how.calibrations.begin(), how.calibrations.end(), IsGeometryCalibration);
  if (file == how.calibrations.end()) return {};
  const GeometryUncertainty geometry(*file);
  const PrintSensitivity print(measurements.filter, field.geometry.grid.basis,
                               field.geometry.grid.spacing_m, measurements.filter_scale);
  std::vector<double> sigmas;
  for (std::size_t q = 0; q < quantities.size(); ++q)
    sigmas.push_back(std::sqrt(GeometryVariance(geometry, measurements, field, weights[q], print,
                                                quantities[q].per_delta)));
  return sigmas;
}

// What settings leave open and calibrations say: the veiling glare as stray light, its share and
// what that may be off by.
ErrorSizes KnownSizes(const BudgetSettings& settings, const MergeSessionOptions& how,
                      const rig::SensorModel& sensor) {
  ErrorSizes sizes = settings.sizes;
  for (const std::filesystem::path& path : how.calibrations)
    if (!sizes.stray_share && IsGlareCalibration(path)) {
      const StatedGlare glare = ReadGlareCalibration(path, sensor);
      sizes.stray_share = std::hypot(glare.share, glare.share_sigma);
    }
  return sizes;
}

// The sizes of the print's errors, with that of its measured place.
ErrorSizes WithFilter(ErrorSizes sizes, const lightfield::MeasuredFilter& filter) {
  sizes.print_shift_m = std::hypot(sizes.print_shift_m.value_or(0), filter.position_sigma_m);
  sizes.density = sizes.density.value_or(0);
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

// Errors that positions have each for itself, besides the photons', relative to what a filter sees:
// about, for they only say how far the posterior may trust differences between neighbours.
double PositionNoise(const ErrorSizes& sizes, double spacing_m) {
  return std::hypot(sizes.lamp_wander.value_or(0), sizes.monitor.value_or(0),
                    sizes.stage_m.value_or(0) / spacing_m);
}

// Of every quantity: from what the settings state of the lamp, else from coarser grids; nothing
// where they want neither.
std::vector<std::optional<double>> BasisSigmas(const ErrorSizes& sizes,
                                               const lightfield::Measurements& measurements,
                                               const LightField& field,
                                               const std::vector<AskedQuantity>& quantities) {
  std::vector<std::optional<double>> sigmas(quantities.size());
  if (!sizes.smallest_spot_m) {
    if (!sizes.estimate_basis) return sigmas;
    std::vector<const std::vector<Term>*> terms;
    for (const AskedQuantity& quantity : quantities) terms.push_back(&quantity.terms);
    return CoarserGridSigmas(field, measurements.filter, terms);
  }
  const BasisTruncation truncation(
      field, measurements.filter,
      {*sizes.smallest_spot_m, PositionNoise(sizes, field.geometry.grid.spacing_m), &measurements});
  for (std::size_t q = 0; q < quantities.size(); ++q)
    sigmas[q] = truncation.Sigma(quantities[q].terms);
  return sigmas;
}

std::vector<double> MissingSigmasOf(const lightfield::Measurements& measurements,
                                    const LightField& field,
                                    const std::vector<AskedQuantity>& quantities,
                                    const std::vector<Weights>& weights,
                                    const std::optional<FilterSystem>& system) {
  std::vector<const Weights*> of_coefficients, of_irradiances;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    of_coefficients.push_back(&quantities[q].weights);
    of_irradiances.push_back(&weights[q]);
  }
  return MissingSigmas(measurements, field, of_coefficients, of_irradiances,
                       system ? &*system : nullptr);
}

// What the photographs of a filter leave open of a quantity, its place aside.
struct FilterSigma {
  double noise = 0, level = 0;
};
FilterSigma SigmaOfFilter(const LightField& field, const lightfield::MeasuredFilter& filter,
                          const Weights& weights) {
  LagSums lags;
  for (int m = 0; m < field.geometry.grid.count(); ++m) lags += SumLags(field, weights, m);
  return {std::sqrt(TexelNoiseVariance(filter, lags) + StretchVariance(filter, lags)),
          std::sqrt(LevelVariance(filter, lags))};
}

}  // namespace

const char* ErrorSourceName(ErrorSource source) { return kNames[static_cast<std::size_t>(source)]; }

double QuantityBudget::Total() const {
  double sum = 0;
  for (const auto& s : sigma) sum += s.value_or(0) * s.value_or(0);
  return std::sqrt(sum);
}

ErrorBudget ComputeErrorBudget(const session::SessionReader& session,
                               const BudgetSettings& settings, const MergeSessionOptions& how,
                               const lightfield::MeasuredFilter* filter) {
  const SessionPlan plan = CalibratedPlan(session, how);
  const auto measurements = MergeSession(session, how);
  ReconstructOptions in_double;
  in_double.precision = Precision::kDouble;
  in_double.filter = filter;
  const LightField field = Reconstruct(measurements, in_double).coefficients;

  std::vector<AskedQuantity> quantities = AskQuantities(field, settings);
  std::optional<ScaledByMeter> scaled;
  if (settings.meter) {
    scaled = ScaleByMeter(field, *settings.meter, &quantities);
    quantities.push_back(std::move(scaled->factor));
  }
  std::optional<FilterSystem> system;
  if (filter) system.emplace(SystemOf(field.geometry.grid, *filter));
  std::vector<Weights> weights;
  std::vector<FilterSigma> by_filter;
  for (const AskedQuantity& q : quantities) {
    weights.push_back(AdjointSolve(measurements, q.weights, system ? &*system : nullptr));
    if (filter) by_filter.push_back(SigmaOfFilter(field, *filter, weights.back()));
  }
  const auto by_missing = MissingSigmasOf(measurements, field, quantities, weights, system);
  const auto by_basis = BasisSigmas(settings.sizes, measurements, field, quantities);
  const auto by_geometry = GeometrySigmas(how, measurements, field, quantities, weights);
  ErrorPropagation propagation({session, plan, how, measurements, field}, std::move(weights));
  MergeSessionOptions observed = how;
  observed.observer = &propagation;
  observed.check_hashes = false;
  MergeSession(session, observed);

  ErrorSizes sizes = KnownSizes(settings, how, plan.sensor);
  if (filter) sizes = WithFilter(sizes, *filter);
  ErrorBudget budget;
  budget.basis_estimated = !sizes.smallest_spot_m && sizes.estimate_basis;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    QuantityBudget& result = budget.quantities.emplace_back();
    result.name = quantities[q].name;
    result.unit = quantities[q].unit;
    result.value = quantities[q].value;
    result.sigma = propagation.Sigma(q, sizes);
    result.sigma[static_cast<std::size_t>(ErrorSource::kMissing)] = by_missing[q];
    result.sigma[static_cast<std::size_t>(ErrorSource::kBasis)] = by_basis[q];
    if (filter) {
      result.sigma[static_cast<std::size_t>(ErrorSource::kFilterNoise)] = by_filter[q].noise;
      auto& density = result.sigma[static_cast<std::size_t>(ErrorSource::kDensity)];
      density = std::hypot(density.value_or(0), by_filter[q].level);
    }
    if (by_geometry)
      result.sigma[static_cast<std::size_t>(ErrorSource::kGeometry)] = (*by_geometry)[q];
    if (scaled)
      result.sigma[static_cast<std::size_t>(ErrorSource::kMeter)] =
          scaled->meter_relative * std::abs(result.value);
  }
  if (plan.tilts) budget.tilt = EffectOfTilts(plan);
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
  return {{"name", quantity.name},
          {"unit", quantity.unit},
          {"value", quantity.value},
          {"sigma", total},
          {"relative", quantity.value != 0 ? total / std::abs(quantity.value) : 0},
          {"sources", sources}};
}

}  // namespace

nlohmann::json ToJson(const ErrorBudget& budget) {
  nlohmann::json quantities = nlohmann::json::array();
  for (const QuantityBudget& quantity : budget.quantities) quantities.push_back(ToJson(quantity));
  const bool basis = !budget.quantities.empty() && budget.quantities[0].of(ErrorSource::kBasis);
  nlohmann::json json{{"quantities", quantities}, {"basis", nullptr}};
  if (basis) json["basis"] = budget.basis_estimated ? "estimated" : "stated";
  if (budget.scale)
    json["scale"] = {{"factor", ToJson(budget.scale->factor)},
                     {"residuals", budget.scale->residuals},
                     {"chi_squared", budget.scale->chi_squared},
                     {"degrees", budget.scale->degrees}};
  if (budget.tilt) json["tilt"] = ToJson(*budget.tilt);
  return json;
}

}  // namespace luxfield::reconstruct
