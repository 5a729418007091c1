#include "luxfield/reconstruct/budget/filter_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::MeasuredFilter;
using lightfield::Measurements;
using lightfield::Vec2;

constexpr std::uint64_t kSeed = 977;
constexpr double kSpacing_m = 0.02;
constexpr int kPerSpacing = 6;

BasisGrid Grid(BasisKind kind = BasisKind::kBspline2) {
  return BasisGrid::Centred(Basis::Make(kind), 3, 3, kSpacing_m);
}

// Texel means of 1.1 Phi, moved by a tenth of a spacing.
MeasuredFilter Filter() {
  MeasuredFilter filter;
  filter.basis = Basis::Make(BasisKind::kBspline2);
  filter.spacing_m = kSpacing_m;
  constexpr int kSize = 4 * kPerSpacing;
  constexpr double kTexel_m = kSpacing_m / kPerSpacing;
  filter.lattice = {kSize,    kSize,   -0.5 * kSize * kTexel_m, 0.5 * kSize * kTexel_m,
                    kTexel_m, kTexel_m};
  const auto mean = [&](double low, double high) {
    return filter.basis.Integral(low + 1.4, high + 1.4) * kPerSpacing;
  };
  auto& print = filter.prints.emplace_back();
  core::Random random(kSeed, 0);
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column) {
      const double x = filter.lattice.s_of_column(column) / kSpacing_m,
                   y = filter.lattice.t_of_row(row) / kSpacing_m;
      print.transmittance.push_back(static_cast<float>(1.1 * mean(x, x + 1.0 / kPerSpacing) *
                                                       mean(y - 1.0 / kPerSpacing, y)));
      print.sigma.push_back(static_cast<float>(0.01 * (1 + random.Uniform())));
    }
  return filter;
}

// Texel means, by midpoints, of both parts of the dual function.
MeasuredFilter Pair() {
  MeasuredFilter filter;
  filter.filter = lightfield::FilterKind::kDual;
  filter.basis = Basis::Make(BasisKind::kQuadratic);
  filter.spacing_m = kSpacing_m;
  constexpr int kFine = 48, kMidpoints = 4, kSize = 2 * kFine;
  constexpr double kTexel_m = kSpacing_m / kFine;
  filter.lattice = {kSize,    kSize,   -0.5 * kSize * kTexel_m, 0.5 * kSize * kTexel_m,
                    kTexel_m, kTexel_m};
  filter.prints.resize(2);
  const auto peaks = filter.basis.DualPeaks();
  for (int row = 0; row < kSize; ++row)
    for (int column = 0; column < kSize; ++column) {
      double parts[2] = {0, 0};
      for (int k = 0; k < kMidpoints * kMidpoints; ++k) {
        const double x = filter.lattice.s_of_column(column) / kSpacing_m +
                         (k % kMidpoints + 0.5) / (kMidpoints * kFine),
                     y = filter.lattice.t_of_row(row) / kSpacing_m -
                         (k / kMidpoints + 0.5) / (kMidpoints * kFine),
                     phi = filter.basis.DualValue(x) * filter.basis.DualValue(y);
        parts[phi < 0] += std::abs(phi) / (kMidpoints * kMidpoints);
      }
      for (int k : {0, 1}) {
        filter.prints[k].transmittance.push_back(static_cast<float>(parts[k] / peaks[k]));
        filter.prints[k].sigma.push_back(0);
      }
    }
  return filter;
}

Measurements RandomMeasurements(bool incomplete, BasisKind kind = BasisKind::kBspline2) {
  Measurements m;
  m.geometry.delta_m = 0.3;
  m.geometry.grid = Grid(kind);
  m.geometry.lattice = {4, 3, -0.05, 0.04, 0.02, 0.02};
  core::Random random(kSeed, 1);
  const std::size_t texels = m.geometry.plane_size();
  for (int k = 0; k < m.geometry.grid.count(); ++k) {
    auto& position = m.positions.emplace_back();
    for (std::size_t p = 0; p < texels; ++p) {
      const bool unknown = incomplete && k == 4 && p % 3 == 0;
      position.mask.push_back(unknown ? std::uint32_t{lightfield::kOffSensor} : 0u);
      position.irradiance.push_back(unknown ? 0 : static_cast<float>(1 + random.Uniform()));
      position.sigma.push_back(unknown ? 0 : 0.01f);
    }
    position.count.assign(texels, 1);
  }
  return m;
}

FilterSystem System(const MeasuredFilter& filter) {
  const BasisGrid grid = Grid(filter.basis.kind);
  std::vector<Vec2> centres;
  for (int m = 0; m < grid.count(); ++m)
    centres.push_back(grid.centre(m % grid.width, m / grid.width));
  return FilterSystem(grid, &filter, centres);
}

lightfield::LightField Solve(const Measurements& measurements, const MeasuredFilter& filter) {
  ReconstructOptions options;
  options.filter = &filter;
  return Reconstruct(measurements, options).coefficients;
}

lightfield::Weights RandomWeights(std::size_t count) {
  core::Random random(kSeed, 2);
  lightfield::Weights q(count);
  for (double& x : q) x = random.Uniform() - 0.3;
  return q;
}

// Of Q = q . C, with C solved as `c`.
LagSums LagsOf(const Measurements& measurements, const MeasuredFilter& filter,
               const lightfield::LightField& c, const lightfield::Weights& q) {
  const FilterSystem system = System(filter);
  const auto w = AdjointSolve(measurements, q, &system);
  LagSums lags;
  for (int m = 0; m < c.geometry.grid.count(); ++m) lags += SumLags(c, w, m);
  return lags;
}

TEST(AdjointSolve, IsTheTransposeOfTheSolveWithAMeasuredFilter) {
  const MeasuredFilter filter = Filter();
  const FilterSystem system = System(filter);
  for (const bool incomplete : {false, true}) {
    const Measurements measurements = RandomMeasurements(incomplete);
    const auto c = Solve(measurements, filter);
    const auto q = RandomWeights(c.data.size());
    const auto w = AdjointSolve(measurements, q, &system);
    double by_irradiance = 0, scale = 0;
    const std::size_t texels = measurements.geometry.plane_size();
    for (std::size_t k = 0; k < w.size(); ++k) {
      const double term = w[k] * measurements.positions[k / texels].irradiance[k % texels];
      by_irradiance += term;
      scale += std::abs(term);
    }
    EXPECT_NEAR(by_irradiance, lightfield::Apply(q, c), 1e-6 * scale);  // C is float32
  }
}

// Every texel moved by its sigma in turn, and all solved again.
TEST(FilterNoise, IsWhatEveryTexelDoesToTheSolution) {
  std::cout << "seed " << kSeed << '\n';
  MeasuredFilter filter = Filter();
  filter.sum_sigma_ratio = 1.25;
  const Measurements measurements = RandomMeasurements(false);
  const auto c = Solve(measurements, filter);
  const auto q = RandomWeights(c.data.size());
  const LagSums lags = LagsOf(measurements, filter, c, q);
  double variance = 0;
  auto& print = filter.prints[0];
  for (std::size_t t = 0; t < print.transmittance.size(); ++t) {
    const float before = print.transmittance[t];
    print.transmittance[t] = before + print.sigma[t];
    const double above = lightfield::Apply(q, Solve(measurements, filter));
    print.transmittance[t] = before - print.sigma[t];
    const double below = lightfield::Apply(q, Solve(measurements, filter));
    print.transmittance[t] = before;
    variance += 0.25 * (above - below) * (above - below);
  }
  // Float32 coefficients, whose rounding is 1e-7 of sums that a texel moves by 1e-3; second order.
  EXPECT_NEAR(std::sqrt(TexelNoiseVariance(filter, lags) / variance) / 1.25, 1, 2e-3);
}

TEST(FilterNoise, LevelOfASinglePrintScalesTheSolution) {
  MeasuredFilter filter = Filter();
  filter.level_sigma = 3e-4;
  const Measurements measurements = RandomMeasurements(false);
  const auto c = Solve(measurements, filter);
  const auto q = RandomWeights(c.data.size());
  // C is E over the filter, whose level is 1.1; the place (a tenth of a spacing) is second order.
  EXPECT_NEAR(std::sqrt(LevelVariance(filter, LagsOf(measurements, filter, c, q))) /
                  std::abs(3e-4 * lightfield::Apply(q, c)),
              1 / 1.1, 0.02);
}

// The light alone, by which both prints are divided, and each print's own light off in turn.
TEST(FilterNoise, LevelsAreWhatEveryPrintDoesToTheSolution) {
  std::cout << "seed " << kSeed << '\n';
  MeasuredFilter filter = Pair();
  filter.level_sigma = 3e-4;
  Measurements measurements = RandomMeasurements(false, BasisKind::kQuadratic);
  measurements.filter = lightfield::FilterKind::kDual;
  const auto c = Solve(measurements, filter);
  const auto q = RandomWeights(c.data.size());
  const LagSums lags = LagsOf(measurements, filter, c, q);
  const double off = filter.level_sigma / std::sqrt(2), large = 100 * off;
  double variance = 0;
  for (const auto& [plus, minus] : {std::pair{1, 1}, {1, 0}, {0, 1}}) {
    const auto with = [&](double by) {
      MeasuredFilter wrong = filter;
      for (float& t : wrong.prints[0].transmittance) t *= static_cast<float>(1 + by * plus);
      for (float& t : wrong.prints[1].transmittance) t *= static_cast<float>(1 + by * minus);
      return lightfield::Apply(q, Solve(measurements, wrong));
    };
    const double change = (with(large) - with(-large)) / 200;
    variance += change * change;
  }
  EXPECT_NEAR(std::sqrt(LevelVariance(filter, lags) / variance), 1, 5e-3);
}

}  // namespace
}  // namespace luxfield::reconstruct
