// The absolute scale by a light meter, against a least-squares fit of three numbers by hand.
#include "luxfield/reconstruct/budget/budget_quantities.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numeric>

#include "luxfield/core/error.h"
#include "tests/lightfield/support.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20261123;

// Coefficients that are multiples of 2^-12, so that sums with 2^-8 of others are exact in float.
LightField RoundField(std::uint64_t seed, double low) {
  LightField field = lightfield::RandomField(
      lightfield::SmallGeometry(Basis::Make(BasisKind::kBspline2)), seed, low, 1);
  for (float& c : field.data) c = std::round(c * 4096) / 4096;
  return field;
}

ReceiverAsked At(double x_m, double z_m) { return {"there", {x_m, 0.01, z_m}, {0, 0, -1}}; }

double Irradiance(const LightField& field, const ReceiverAsked& at) {
  return Apply(lightfield::IrradianceWeights(field.geometry, at.p_m, at.normal), field);
}

// Three readings: `factor` times what the field shows, times 1 + error.
Meter Read(const LightField& field, double factor, const std::vector<double>& errors) {
  Meter meter;
  meter.calibration = 0.004;
  const ReceiverAsked places[] = {At(0.02, 0.5), At(-0.1, 0.9), At(0.3, 1.4)};
  for (std::size_t n = 0; n < errors.size(); ++n)
    meter.readings.push_back(
        {places[n], factor * Irradiance(field, places[n]) * (1 + errors[n]),
         (0.01 + 0.01 * static_cast<double>(n)) * Irradiance(field, places[n])});
  return meter;
}

std::vector<AskedQuantity> Ask(const LightField& field) {
  BudgetSettings settings;
  settings.rays = {{"ray", {0.01, -0.004}, {0.02, 0.01}}};
  settings.receivers = {At(0.02, 0.5), At(0.05, 2)};
  return AskQuantities(field, settings);
}

TEST(ScaleByMeter, FactorAndResidualsAreThoseOfTheWeightedFit) {
  const LightField field = RoundField(kSeed, 0.2);
  const std::vector<double> errors = {0.02, -0.01, 0.03};
  const Meter meter = Read(field, 1.7, errors);
  auto quantities = Ask(field);
  const auto before = quantities;
  const ScaledByMeter result = ScaleByMeter(field, meter, &quantities);
  // sigma is 1, 2 and 3 % of E: of R / E = 1.7 (1 + error) the mean with weights 1, 1/4 and 1/9.
  const double weights = 1 + 0.25 + 1.0 / 9;
  const double factor = 1.7 * (1 + (errors[0] + errors[1] / 4 + errors[2] / 9) / weights);
  EXPECT_NEAR(result.factor.value, factor, 1e-12);
  EXPECT_NEAR(result.meter_relative, std::hypot(0.004, 0.01 / std::sqrt(weights) / factor), 1e-12);
  ASSERT_EQ(result.scale.residuals.size(), 3u);
  double chi_squared = 0;
  for (std::size_t n = 0; n < 3; ++n) {
    const double ratio = 1.7 * (1 + errors[n]);
    EXPECT_NEAR(result.scale.residuals[n], ratio / factor - 1, 1e-12);
    chi_squared += std::pow((ratio - factor) / (0.01 + 0.01 * static_cast<double>(n)), 2);
  }
  EXPECT_NEAR(result.scale.chi_squared, chi_squared, 1e-9);
  EXPECT_EQ(result.scale.degrees, 2);
  for (std::size_t q = 0; q < quantities.size(); ++q)
    EXPECT_NEAR(quantities[q].value, factor * before[q].value, 1e-12 * factor * before[q].value);
}

// One reading: the quantity at the meter's own place is what the meter says, whatever the session
// errs by, and the flux errs by its ratio to that alone.
TEST(ScaleByMeter, WhatQuantityAndReadingShareCancels) {
  const LightField field = RoundField(kSeed + 1, 0.2);
  const Meter meter = Read(field, 0.8, {0});
  auto quantities = Ask(field);
  const auto before = quantities;
  const ScaledByMeter result = ScaleByMeter(field, meter, &quantities);
  const AskedQuantity &there = quantities[2], &unscaled = before[2];
  EXPECT_NEAR(there.value, meter.readings[0].value, 1e-12 * there.value);
  double largest = 0, was = 0;
  for (std::size_t k = 0; k < there.weights.size(); ++k) {
    largest = std::max(largest, std::abs(there.weights[k]));
    was = std::max(was, std::abs(unscaled.weights[k]));
  }
  EXPECT_GT(was, 0);
  EXPECT_LT(largest, 1e-13 * was);
  EXPECT_NEAR(there.per_delta, 0, 1e-10 * std::abs(unscaled.per_delta));
  EXPECT_EQ(result.scale.degrees, 0);
  EXPECT_NEAR(result.scale.chi_squared, 0, 1e-20);
  // All coefficients 1 % brighter change nothing of any quantity.
  for (const AskedQuantity& q : quantities)
    EXPECT_NEAR(Apply(q.weights, field), 0, 1e-10 * q.value) << q.name;
}

// Weights are the derivatives: the meter says the same and the field differs by a little. Terms
// are the same forms.
TEST(ScaleByMeter, WeightsAreTheDerivativesOfWhatIsScaled) {
  const LightField field = RoundField(kSeed + 2, 0.2), other = RoundField(kSeed + 3, -1);
  const Meter meter = Read(field, 1.3, {0, 0, 0});
  constexpr float kStep = 1.0f / 256;
  const auto scaled = [&](float step) {
    LightField moved = field;
    for (std::size_t k = 0; k < moved.data.size(); ++k) moved.data[k] += step * other.data[k];
    auto quantities = Ask(moved);
    auto result = ScaleByMeter(moved, meter, &quantities);
    quantities.push_back(std::move(result.factor));
    return quantities;
  };
  const auto here = scaled(0), above = scaled(kStep), below = scaled(-kStep);
  ASSERT_EQ(here.size(), 5u);  // flux, ray, two receivers, the factor
  for (std::size_t q = 0; q < here.size(); ++q) {
    const double by_weights = Apply(here[q].weights, other),
                 by_steps = (above[q].value - below[q].value) / (2.0 * kStep);
    std::printf("%-12s d/dstep %.8g by weights, %.8g by steps\n", here[q].name.c_str(), by_weights,
                by_steps);
    // Steps of 2^-8 are good to 2^-16 of the value, times numbers about 1.
    EXPECT_NEAR(by_weights, by_steps, 1e-4 * here[q].value) << here[q].name;
    lightfield::Weights by_terms(here[q].weights.size(), 0.0);
    for (const Term& term : here[q].terms) {
      const auto weights = term.form.weights(field.geometry);
      for (std::size_t k = 0; k < weights.size(); ++k) by_terms[k] += term.factor * weights[k];
    }
    const double scale = std::sqrt(std::inner_product(
        here[q].weights.begin(), here[q].weights.end(), here[q].weights.begin(), 0.0));
    for (std::size_t k = 0; k < by_terms.size(); ++k)
      ASSERT_NEAR(by_terms[k], here[q].weights[k], 1e-10 * std::max(scale, 1e-3 * here[q].value))
          << here[q].name;
  }
  EXPECT_GT(std::abs(above[0].value - below[0].value), 1e-4 * here[0].value);
}

TEST(ScaleByMeter, RefusesAReadingWhereTheSessionShowsNoLight) {
  LightField dark = RoundField(kSeed, 0.2);
  const Meter meter = Read(dark, 1, {0, 0});
  std::fill(dark.data.begin(), dark.data.end(), 0.0f);
  auto quantities = Ask(dark);
  try {
    ScaleByMeter(dark, meter, &quantities);
    FAIL() << "a factor of nothing";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'there'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
