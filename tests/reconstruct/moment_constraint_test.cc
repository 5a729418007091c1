#include "luxfield/reconstruct/solve/moment_constraint.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/adjoint_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::Measurements;
using lightfield::Vec2;

constexpr std::uint64_t kSeed = 20263;

lightfield::LuminaireGeometry Geometry(BasisKind kind, int width, int height, int texels = 2) {
  lightfield::LuminaireGeometry geometry;
  geometry.delta_m = 0.6;
  geometry.grid = BasisGrid::Centred(Basis::Make(kind), width, height, 0.033);
  geometry.lattice = {texels, 1, -0.3, 0.2, 0.6 / texels, 0.2};
  return geometry;
}

// An even rectangle of light on F, as filters see it that stand where they were displaced to.
struct Patch {
  double x0, x1, y0, y1;
  double flux() const { return (x1 - x0) * (y1 - y0) * 1e4; }
};
double Seen(const BasisGrid& grid, const Patch& patch, int m, Vec2 off) {
  const double h = grid.spacing_m;
  const auto along = [&](double first, int k, double x0, double x1) {
    return h * grid.basis.Integral((x0 - first) / h - k, (x1 - first) / h - k);
  };
  return 1e4 * along(grid.u0_m + off.x, m % grid.width, patch.x0, patch.x1) *
         along(grid.v0_m + off.y, m / grid.width, patch.y0, patch.y1);
}

// `noise`: standard deviation of every position, of the largest E; also stated as sigma, at least
// 1e-6 of it.
Measurements Measure(const lightfield::LuminaireGeometry& geometry, const Patch& patch,
                     const std::vector<Vec2>& displacements, const std::vector<double>& noise,
                     core::Random& random) {
  Measurements result;
  result.geometry = geometry;
  const BasisGrid& grid = geometry.grid;
  double largest = 0;
  for (int m = 0; m < grid.count(); ++m)
    largest = std::max(largest, Seen(grid, patch, m, displacements[m]));
  for (int m = 0; m < grid.count(); ++m) {
    lightfield::Measurement& position = result.positions.emplace_back();
    const double sigma = noise[m] * largest, e = Seen(grid, patch, m, displacements[m]);
    for (std::size_t p = 0; p < geometry.plane_size(); ++p)
      position.irradiance.push_back(static_cast<float>(e + sigma * random.Normal()));
    position.sigma.assign(geometry.plane_size(),
                          static_cast<float>(std::max(sigma, 1e-6 * largest)));
    position.count.assign(geometry.plane_size(), 1);
    position.mask.assign(geometry.plane_size(), 0);
    position.displacement_m = displacements[m];
  }
  return result;
}

double FluxOf(const lightfield::LightField& field, std::size_t texel) {
  double flux = 0;
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    flux += field.geometry.grid.PhiIntegral() * field.image(m, 0)[texel];
  return flux;
}

std::vector<Vec2> Displacements(const BasisGrid& grid, double rms_h, core::Random& random) {
  std::vector<Vec2> result;
  for (int m = 0; m < grid.count(); ++m) {
    const double x = random.Normal(), y = random.Normal();
    result.push_back(rms_h * grid.spacing_m * Vec2{x, y});
  }
  return result;
}

Reconstruction Solve(std::span<const Measurements> measurements, Keep keep,
                     std::optional<double> lambda = {}) {
  ReconstructOptions options;
  options.precision = Precision::kDouble;
  options.keep = keep;
  options.regularise = lambda.has_value();
  options.lambda = lambda;
  return Reconstruct(measurements, options);
}

// The stage stands a little off: least squares of what it measured lose flux as ever, the weights
// that make the displaced filters nearly even keep it about as well as their residual says.
TEST(MomentConstraint, KeepsTheFluxBehindDisplacedFilters) {
  for (const BasisKind kind : {BasisKind::kBspline2, BasisKind::kBilinear}) {
    const auto geometry = Geometry(kind, 8, 7);
    const Patch patch{-0.06, 0.05, -0.05, 0.04};
    const std::vector<double> no_noise(geometry.grid.count(), 0);
    core::Random random(kSeed, 1);
    double kept2 = 0, plain2 = 0, residual = 0;
    constexpr int kDraws = 20;
    for (int n = 0; n < kDraws; ++n) {
      const auto displaced =
          Measure(geometry, patch, Displacements(geometry.grid, 0.02, random), no_noise, random);
      const auto kept = Solve({&displaced, 1}, Keep::kMoments),
                 plain = Solve({&displaced, 1}, Keep::kNone);
      ASSERT_EQ(kept.report.solve, "general");
      ASSERT_EQ(kept.report.kept.u, 2);
      kept2 += std::pow(FluxOf(kept.coefficients, 0) / patch.flux() - 1, 2);
      plain2 += std::pow(FluxOf(plain.coefficients, 0) / patch.flux() - 1, 2);
      residual += kept.report.moment_residual.value() / kDraws;
    }
    const double kept_rms = std::sqrt(kept2 / kDraws), plain_rms = std::sqrt(plain2 / kDraws);
    std::printf("seed %llu: flux off by %.3f %% kept, %.3f %% plain; residual of a point %.2f %%\n",
                static_cast<unsigned long long>(kSeed), 100 * kept_rms, 100 * plain_rms,
                100 * residual);
    EXPECT_LT(kept_rms, plain_rms / 3);
    EXPECT_LT(kept_rms, residual);  // the patch averages over cells
    EXPECT_LT(residual, 0.03);
  }
}

// Where the filters stand as planned the constraint is that of ideal ones: a = 1 and the centres.
TEST(MomentConstraint, OfIdealFiltersIsTheirSum) {
  const auto geometry = Geometry(BasisKind::kBspline2, 6, 7);
  const BasisGrid& grid = geometry.grid;
  std::vector<Vec2> centres;
  for (int m = 0; m < grid.count(); ++m) centres.push_back(grid.centre(m % 6, m / 6));
  const auto kept = ConstrainMoments(FilterSystem(grid, nullptr, centres), grid, {2, 2});
  ASSERT_EQ(kept.moments, 3);
  EXPECT_LT(kept.residual, 1e-9);
  EXPECT_GT(kept.residual_of_least_squares, 0.01);
  for (int m = 0; m < grid.count(); ++m) {
    EXPECT_NEAR(kept.measured[m * 3], 1, 1e-9);
    EXPECT_NEAR(kept.measured[m * 3 + 1], centres[m].x / grid.spacing_m, 1e-9);
    EXPECT_NEAR(kept.measured[m * 3 + 2], centres[m].y / grid.spacing_m, 1e-9);
  }
  EXPECT_EQ(ConstrainMoments(FilterSystem(grid, nullptr, centres), grid, {2, 0}).moments, 0);
}

// chi-squared of every C over many noisy texels, of one displaced capture and of two captures that
// differ in noise and are weighted by it.
TEST(MomentConstraint, SigmaIsThatOfTheMap) {
  constexpr int kTexels = 4000;
  const auto geometry = Geometry(BasisKind::kBilinear, 4, 5, kTexels);
  const Patch patch{-0.04, 0.03, -0.04, 0.05};
  core::Random random(kSeed, 2);
  const auto off = Displacements(geometry.grid, 0.02, random);
  for (const int captures : {1, 2}) {
    std::vector<Measurements> noisy, exact;
    for (int c = 0; c < captures; ++c) {
      std::vector<double> noise, none(geometry.grid.count(), 0);
      for (int m = 0; m < geometry.grid.count(); ++m)
        noise.push_back(0.02 * std::pow(10, -random.Uniform()));
      noisy.push_back(Measure(geometry, patch, off, noise, random));
      exact.push_back(Measure(geometry, patch, off, none, random));
      // The same weights for the truth.
      for (int m = 0; m < geometry.grid.count(); ++m)
        exact[c].positions[m].sigma = noisy[c].positions[m].sigma;
    }
    const auto solved = Solve(noisy, Keep::kMoments), truth = Solve(exact, Keep::kMoments);
    ASSERT_EQ(solved.report.kept.u, 2);
    double worst = 0;
    for (int m = 0; m < geometry.grid.count(); ++m) {
      double pull2 = 0;
      for (int p = 0; p < kTexels; ++p)
        pull2 += std::pow((solved.coefficients.image(m, 0)[p] - truth.coefficients.image(m, 0)[p]) /
                              solved.sigma.image(m, 0)[p],
                          2);
      worst = std::max(worst, std::abs(pull2 - kTexels) / std::sqrt(2.0 * kTexels));
    }
    std::printf("seed %llu: %d captures, worst z of %d chi-squared %.2f\n",
                static_cast<unsigned long long>(kSeed), captures, geometry.grid.count(), worst);
    EXPECT_LT(worst, 4.5);
  }
}

// A smooth solution has the flux as well, whatever lambda takes from the rest.
TEST(MomentConstraint, RegularisedSolutionsKeepTheFlux) {
  const auto geometry = Geometry(BasisKind::kBspline2, 7, 7, 40);
  const Patch patch{-0.06, 0.05, -0.05, 0.04};
  core::Random random(kSeed, 3);
  const auto noisy =
      Measure(geometry, patch, std::vector<Vec2>(49), std::vector<double>(49, 1e-3), random);
  const auto kept = Solve({&noisy, 1}, Keep::kMoments, 0.5),
             plain = Solve({&noisy, 1}, Keep::kNone, 0.5);
  double of_kept = 0, of_plain = 0, sum_e = 0;
  for (std::size_t p = 0; p < geometry.plane_size(); ++p) {
    of_kept += FluxOf(kept.coefficients, p);
    of_plain += FluxOf(plain.coefficients, p);
    for (const auto& position : noisy.positions) sum_e += position.irradiance[p];
  }
  EXPECT_NEAR(of_kept, sum_e, 1e-6 * sum_e);
  EXPECT_GT(std::abs(of_plain - sum_e), 5e-3 * sum_e);
  EXPECT_NEAR(kept.report.regularisation->flux_bias, 0, 1e-9);
  EXPECT_GT(std::abs(plain.report.regularisation->flux_bias), 1e-4);
  // The stated noise is that of the sigma that is written.
  double variance = 0, square = 0;
  for (const float s : kept.sigma.data) variance += double{s} * s;
  const auto unregularised = Solve({&noisy, 1}, Keep::kNone);
  for (const float c : unregularised.coefficients.data) square += double{c} * c;
  for (const float s : unregularised.sigma.data) square -= double{s} * s;
  EXPECT_NEAR(kept.report.regularisation->noise, std::sqrt(variance / square),
              0.01 * std::sqrt(variance / square));
}

// What budgets propagate through a measured filter's system is the transpose of what was solved.
TEST(MomentConstraint, AdjointIsTheTransposeOfTheSolve) {
  const auto geometry = Geometry(BasisKind::kBspline2, 5, 6, 3);
  core::Random random(kSeed, 4);
  const BasisGrid& grid = geometry.grid;
  const auto off = Displacements(grid, 0.02, random);
  const auto measured = Measure(geometry, {-0.03, 0.02, -0.03, 0.04}, off,
                                std::vector<double>(grid.count(), 0), random);
  std::vector<Vec2> centres;
  for (int m = 0; m < grid.count(); ++m)
    centres.push_back(grid.centre(m % grid.width, m / grid.width) + off[m]);
  const FilterSystem system(grid, nullptr, centres);
  const auto solved = Solve({&measured, 1}, Keep::kMoments);
  lightfield::Weights q(geometry.value_count());
  for (double& x : q) x = random.Normal();
  const auto w = AdjointSolve(measured, q, &system);
  double of_c = 0, of_e = 0, size = 0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    of_c += q[k] * solved.coefficients.data[k];
    const double term = w[k] * measured.positions[k / 3].irradiance[k % 3];
    of_e += term;
    size += std::abs(term);
  }
  EXPECT_NEAR(of_c, of_e, 1e-6 * size);
}

}  // namespace
}  // namespace luxfield::reconstruct
