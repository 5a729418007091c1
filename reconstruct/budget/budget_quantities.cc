#include "luxfield/reconstruct/budget/budget_quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Weights;

double PerDelta(const LightField& field, const LinearForm& form) {
  constexpr double kStep = 1e-4;  // relative; the error of a central difference is its square
  LuminaireGeometry above = field.geometry, below = field.geometry;
  above.delta_m *= 1 + kStep;
  below.delta_m *= 1 - kStep;
  return (Apply(form.weights(above), field) - Apply(form.weights(below), field)) /
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

LinearForm IrradianceAt(const ReceiverAsked& at) {
  return {[at](const LuminaireGeometry& geometry) {
            return IrradianceWeights(geometry, at.p_m, at.normal);
          },
          {}};
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

}  // namespace

std::vector<AskedQuantity> AskQuantities(const LightField& field, BudgetSettings settings) {
  if (settings.rays.empty() && settings.receivers.empty()) AskWhatIsUsual(field, &settings);
  const LuminaireGeometry& g = field.geometry;
  std::vector<AskedQuantity> quantities;
  const auto ask = [&](const std::string& name, const std::string& unit, const LinearForm& form) {
    AskedQuantity& q = quantities.emplace_back();
    q.name = name;
    q.unit = unit;
    q.weights = form.weights(g);
    q.value = Apply(q.weights, field);
    q.terms = {{1, form}};
    q.per_delta = PerDelta(field, form);
  };
  ask("flux", lightfield::FluxUnitName(g.unit), {lightfield::FluxWeights, {}});
  for (const RayAsked& ray : settings.rays)
    ask(ray.name, RadianceUnit(g.unit),
        {[ray](const LuminaireGeometry& geometry) {
           return RadianceWeights(geometry, ray.u_m, ray.s_m);
         },
         ray.s_m});
  for (const ReceiverAsked& at : settings.receivers)
    ask(at.name, IrradianceUnit(g.unit), IrradianceAt(at));
  return quantities;
}

ScaledByMeter ScaleByMeter(const LightField& field, const Meter& meter,
                           std::vector<AskedQuantity>* quantities) {
  ScaledByMeter result;
  double numerator = 0, denominator = 0;
  std::vector<Weights> weights;
  std::vector<double> values, per_delta;
  for (const MeterReading& reading : meter.readings) {
    const LinearForm at = IrradianceAt(reading.at);
    weights.push_back(at.weights(field.geometry));
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
  std::vector<Term> common_terms;
  double common_per_delta = 0;
  for (std::size_t n = 0; n < weights.size(); ++n) {
    const MeterReading& reading = meter.readings[n];
    const double share = values[n] / (reading.sigma * reading.sigma * denominator);
    for (std::size_t k = 0; k < common.size(); ++k) common[k] += share * weights[n][k];
    common_per_delta += share * per_delta[n];
    common_terms.push_back({share, IrradianceAt(reading.at)});
    const double residual = reading.value / (factor * values[n]) - 1;
    result.scale.residuals.push_back(residual);
    const double by_sigma = (reading.value - factor * values[n]) / reading.sigma;
    result.scale.chi_squared += by_sigma * by_sigma;
  }
  result.scale.degrees = static_cast<int>(values.size()) - 1;
  result.meter_relative = std::hypot(meter.calibration, 1 / (factor * std::sqrt(denominator)));
  for (AskedQuantity& q : *quantities) {
    for (std::size_t k = 0; k < common.size(); ++k)
      q.weights[k] = factor * (q.weights[k] - q.value * common[k]);
    q.per_delta = factor * (q.per_delta - q.value * common_per_delta);
    for (Term& term : q.terms) term.factor *= factor;
    for (const Term& term : common_terms)
      q.terms.push_back({-factor * q.value * term.factor, term.form});
    q.value *= factor;
  }
  for (double& w : common) w *= -factor;
  for (Term& term : common_terms) term.factor *= -factor;
  result.factor = {"scale factor",
                   "",
                   factor,
                   std::move(common),
                   std::move(common_terms),
                   -factor * common_per_delta};
  return result;
}

}  // namespace luxfield::reconstruct
