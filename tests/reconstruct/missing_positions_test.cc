#include "luxfield/reconstruct/budget/missing_positions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LightField;
using lightfield::Measurements;
using lightfield::Weights;

constexpr int kTexels = 2;

// A lamp of one coefficient everywhere, as seen where `known` says.
Measurements Seen(FilterKind filter, const std::vector<bool>& known, float coefficient) {
  Measurements measurements;
  auto& g = measurements.geometry;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(
      Basis::Make(filter == FilterKind::kDual ? BasisKind::kQuadratic : BasisKind::kBspline2), 5, 4,
      0.02);
  g.lattice = {kTexels, 1, 0, 0, 0.02, 0.02};
  measurements.filter = filter;
  const auto count = static_cast<std::size_t>(g.grid.count());
  std::vector<double> c(count, coefficient), e(count);
  if (filter == FilterKind::kBasis)
    GramSolver(g.grid).Forward(c.data(), e.data());
  else
    for (double& x : e) x = coefficient * 0.02 * 0.02;
  for (std::size_t m = 0; m < count; ++m) {
    auto& position = measurements.positions.emplace_back();
    const bool is_known = known[m];
    position.irradiance.assign(kTexels, is_known ? static_cast<float>(e[m]) : 0.0f);
    position.sigma.assign(kTexels, is_known ? 1e-12f : 0.0f);
    position.count.assign(kTexels, 1);
    position.mask.assign(kTexels, is_known ? 0u : std::uint32_t{lightfield::kOffSensor});
  }
  return measurements;
}

double SigmaOf(const Measurements& measurements, const Weights& q,
               const FilterSystem* system = nullptr) {
  const LightField field = Reconstruct(measurements).coefficients;
  const Weights w = AdjointSolve(measurements, q, system);
  const Weights *of_coefficients[] = {&q}, *of_irradiances[] = {&w};
  return MissingSigmas(measurements, field, of_coefficients, of_irradiances, system)[0];
}

double Error(const Measurements& measurements, const Weights& q, float coefficient) {
  const LightField field = Reconstruct(measurements).coefficients;
  double error = 0;
  for (std::size_t k = 0; k < q.size(); ++k) error += q[k] * (coefficient - field.data[k]);
  return error;
}

std::vector<bool> Known(std::initializer_list<std::size_t> missing) {
  std::vector<bool> known(20, true);
  for (const std::size_t m : missing) known[m] = false;
  return known;
}

// A constant lamp has no variance about its mean: what is stated is the very error, whatever is
// missing and whatever is asked.
TEST(MissingPositions, StateTheErrorOfAConstantLamp) {
  constexpr float kC = 3;
  for (const FilterKind filter : {FilterKind::kBasis, FilterKind::kDual})
    for (const auto& known : {Known({7}), Known({0, 5, 10, 15}), Known({0, 1, 2, 3, 4, 12}),
                              Known({3, 8, 13, 18, 4, 9, 14, 19})}) {
      const Measurements measurements = Seen(filter, known, kC);
      Weights flux(20 * kTexels, 1.0), one(20 * kTexels);
      for (std::size_t m = 0; m < 20; ++m)
        if (!known[m]) one[m * kTexels] = 1;
      for (const Weights& q : {flux, one}) {
        const double error = std::abs(Error(measurements, q, kC));
        ASSERT_GT(error, 0.01);
        EXPECT_NEAR(SigmaOf(measurements, q), error, 1e-3 * error);
      }
    }
}

// With the system as a matrix it is the same.
TEST(MissingPositions, AgreeBetweenGramAndMatrix) {
  const Measurements measurements = Seen(FilterKind::kBasis, Known({0, 5, 10, 15, 7}), 2);
  const BasisGrid& grid = measurements.geometry.grid;
  std::vector<lightfield::Vec2> centres;
  for (int m = 0; m < grid.count(); ++m)
    centres.push_back(grid.centre(m % grid.width, m / grid.width));
  const FilterSystem system(grid, nullptr, centres);
  Weights q(20 * kTexels);
  for (std::size_t k = 0; k < q.size(); ++k) q[k] = std::sin(1.0 + static_cast<double>(k));
  EXPECT_NEAR(SigmaOf(measurements, q, &system) / SigmaOf(measurements, q), 1, 1e-6);
}

TEST(MissingPositions, LeaveNothingOpenWhereNoneIsMissing) {
  const Measurements whole = Seen(FilterKind::kBasis, Known({}), 2);
  EXPECT_EQ(SigmaOf(whole, Weights(20 * kTexels, 1.0)), 0);
  // Nor where what is asked lies in what was seen.
  const Measurements dual = Seen(FilterKind::kDual, Known({7}), 2);
  Weights elsewhere(20 * kTexels);
  elsewhere[3 * kTexels] = 1;
  EXPECT_EQ(SigmaOf(dual, elsewhere), 0);
}

// A texel that saw nothing is as the other one, which saw all.
TEST(MissingPositions, TakeADarkTexelFromTheOthers) {
  constexpr float kC = 3;
  for (const FilterKind filter : {FilterKind::kBasis, FilterKind::kDual}) {
    Measurements measurements = Seen(filter, Known({}), kC);
    for (auto& position : measurements.positions) {
      position.mask[1] = lightfield::kDefect;
      position.irradiance[1] = position.sigma[1] = 0;
    }
    EXPECT_NEAR(SigmaOf(measurements, Weights(20 * kTexels, 1.0)), 20 * kC, 1e-4);
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
