#include "luxfield/reconstruct/solve/non_negative.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::uint64_t kSeed = 5150;

GramSolver Solver(int width, int height) {
  lightfield::BasisGrid grid;
  grid.width = width;
  grid.height = height;
  grid.spacing_m = 0.02;
  return GramSolver(grid);
}

Matrix Dense(const GramSolver& solver) {
  const int width = solver.u().count, count = solver.count();
  Matrix gram(count, count);
  for (int m = 0; m < count; ++m)
    for (int n = 0; n < count; ++n)
      gram(m, n) = solver.u().gram[m % width * width + n % width] *
                   solver.v().gram[m / width * solver.v().count + n / width];
  return gram;
}

std::vector<double> RandomCoefficients(int count, std::size_t pixels, double shift) {
  core::Random random(kSeed, static_cast<std::uint64_t>(count));
  std::vector<double> c(count * pixels);
  for (double& x : c) x = random.Normal() + shift;
  return c;
}

std::vector<double*> Rows(std::vector<double>& c, int count) {
  std::vector<double*> rows;
  for (int m = 0; m < count; ++m) rows.push_back(c.data() + m * (c.size() / count));
  return rows;
}

TEST(NonNegative, SatisfiesTheKktConditions) {
  const GramSolver solver = Solver(11, 9);
  constexpr std::size_t kPixels = 100;
  const std::vector<double> start = RandomCoefficients(99, kPixels, 0.5);
  std::vector<double> c = start;
  const NonNegativeSummary summary =
      ProjectNonNegative(solver, Rows(c, 99).data(), kPixels, {false, false, 1e-9, 5000});
  EXPECT_EQ(summary.pixels, kPixels);
  EXPECT_EQ(summary.unconverged, 0u);
  const Matrix gram = Dense(solver);
  for (std::size_t p = 0; p < kPixels; ++p) {
    Eigen::VectorXd difference(99);
    double scale = 0;
    for (int m = 0; m < 99; ++m) {
      difference(m) = c[m * kPixels + p] - start[m * kPixels + p];
      scale = std::max(scale, std::abs(start[m * kPixels + p]));
    }
    const Eigen::VectorXd gradient = gram * difference / gram.diagonal().maxCoeff();
    for (int m = 0; m < 99; ++m) {
      const double x = c[m * kPixels + p];
      EXPECT_GE(x, 0);
      EXPECT_GE(gradient(m), -1e-8 * scale);              // no descent into the cone
      EXPECT_LE(std::min(x, gradient(m)), 1e-8 * scale);  // complementary
    }
  }
}

class NonNegativeGrid : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(NonNegativeGrid, AgreesWithTheBestOfAllActiveSets) {
  const auto [width, height] = GetParam();
  const int count = width * height;
  const GramSolver solver = Solver(width, height);
  const Matrix gram = Dense(solver);
  constexpr std::size_t kPixels = 20;
  const std::vector<double> start = RandomCoefficients(count, kPixels, 0);
  std::vector<double> c = start;
  ProjectNonNegative(solver, Rows(c, count).data(), kPixels, {false, false, 1e-10, 5000});
  for (std::size_t p = 0; p < kPixels; ++p) {
    Eigen::VectorXd c0(count);
    for (int m = 0; m < count; ++m) c0(m) = start[m * kPixels + p];
    Eigen::VectorXd best = Eigen::VectorXd::Zero(count);
    double least = c0.dot(gram * c0);
    for (int set = 1; set < 1 << count; ++set) {
      std::vector<int> free;
      for (int m = 0; m < count; ++m)
        if (set >> m & 1) free.push_back(m);
      const Matrix g = gram(free, free);
      const Eigen::VectorXd e = (gram * c0)(free);
      Eigen::VectorXd x = Eigen::VectorXd::Zero(count);
      const Eigen::VectorXd solved = g.ldlt().solve(e);
      for (std::size_t k = 0; k < free.size(); ++k) x(free[k]) = solved(k);
      if (x.minCoeff() < 0) continue;
      const double value = (x - c0).dot(gram * (x - c0));
      if (value < least) {
        least = value;
        best = x;
      }
    }
    for (int m = 0; m < count; ++m) EXPECT_NEAR(c[m * kPixels + p], best(m), 1e-7) << "pixel " << p;
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, NonNegativeGrid,
                         testing::Values(std::pair(1, 1), std::pair(2, 1), std::pair(1, 5),
                                         std::pair(5, 1), std::pair(2, 4), std::pair(3, 3)));

TEST(NonNegative, KeepsTheFluxAndSatisfiesTheKktConditions) {
  const GramSolver solver = Solver(11, 9);
  constexpr std::size_t kPixels = 100;
  const std::vector<double> start = RandomCoefficients(99, kPixels, 0.2);
  std::vector<double> c = start;
  const NonNegativeSummary summary =
      ProjectNonNegative(solver, Rows(c, 99).data(), kPixels, {true, false, 1e-9, 5000});
  EXPECT_EQ(summary.unconverged, 0u);
  const Matrix gram = Dense(solver);
  int dark = 0;
  for (std::size_t p = 0; p < kPixels; ++p) {
    Eigen::VectorXd x(99), x0(99);
    for (int m = 0; m < 99; ++m) {
      x(m) = c[m * kPixels + p];
      x0(m) = start[m * kPixels + p];
    }
    if (!(x0.sum() > 0)) {
      ++dark;
      EXPECT_EQ(x.cwiseAbs().maxCoeff(), 0);
      continue;
    }
    EXPECT_GE(x.minCoeff(), 0);
    EXPECT_NEAR(x.sum(), x0.sum(), 1e-9 * x0.cwiseAbs().sum());
    // One multiplier: the gradient is equal where x > 0 and not below that elsewhere.
    const Eigen::VectorXd gradient = gram * (x - x0) / gram.diagonal().maxCoeff();
    const double multiplier = gradient.dot(x) / x.sum(), scale = x0.cwiseAbs().maxCoeff();
    for (int m = 0; m < 99; ++m) {
      EXPECT_GE(gradient(m) - multiplier, -1e-7 * scale);
      if (x(m) > 1e-6 * scale) {
        EXPECT_NEAR(gradient(m), multiplier, 1e-7 * scale);
      }
    }
  }
  EXPECT_GT(dark, 0);
  EXPECT_LT(dark, 50);
}

TEST(NonNegative, KeepsAPointFromGainingFlux) {
  // A point at the middle of basis (5, 4): E = Phi, C_0 = G^-1 Phi.
  const GramSolver solver = Solver(11, 9);
  const lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  Eigen::VectorXd e(99);
  for (int m = 0; m < 99; ++m) e(m) = basis.Value(5 + 1.5 - m % 11) * basis.Value(4 + 1.5 - m / 11);
  const Eigen::VectorXd c0 = Dense(solver).llt().solve(e);
  std::vector<double> plain(c0.data(), c0.data() + 99), kept = plain;
  ProjectNonNegative(solver, Rows(plain, 99).data(), 1, {false, false, 1e-10, 5000});
  ProjectNonNegative(solver, Rows(kept, 99).data(), 1, {true, false, 1e-10, 5000});
  const auto sum = [](const std::vector<double>& c) {
    double total = 0;
    for (const double x : c) total += x;
    return total;
  };
  EXPECT_NEAR(sum(plain) / c0.sum(), 1.86, 0.02);  // ((3/4) / (11/20))^2
  EXPECT_NEAR(sum(kept) / c0.sum(), 1, 1e-9);
}

TEST(NonNegative, LeavesNonNegativePixelsAlone) {
  const GramSolver solver = Solver(5, 4);
  std::vector<float> c(20 * 3, 0.1f);
  c[7 * 3 + 1] = -1;  // pixel 1 only
  const std::vector<float> before = c;
  std::vector<float*> rows;
  for (int m = 0; m < 20; ++m) rows.push_back(c.data() + m * 3);
  const NonNegativeSummary summary = ProjectNonNegative(solver, rows.data(), 3);
  EXPECT_EQ(summary.pixels, 1u);
  for (int m = 0; m < 20; ++m) {
    EXPECT_EQ(c[m * 3], before[m * 3]);
    EXPECT_EQ(c[m * 3 + 2], before[m * 3 + 2]);
    EXPECT_GE(c[m * 3 + 1], 0);
  }
}

// Where there is no number there is none to invent, whatever the other coefficients are.
TEST(NonNegative, APixelWithoutANumberStaysAsItIsAndLeavesItsNeighboursAlone) {
  const GramSolver solver = Solver(11, 9);
  constexpr std::size_t kPixels = 40;
  for (const bool keep_flux : {true, false})
    for (const double unknown :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      std::vector<double> c = RandomCoefficients(99, kPixels, 0), alone = c;
      for (int m = 0; m < 99; ++m) alone[m * kPixels + 5] = 0;  // nothing to do there
      c[7 * kPixels + 5] = unknown;
      const std::vector<double> before = c;
      const NonNegativeOptions options{keep_flux};
      ProjectNonNegative(solver, Rows(alone, 99).data(), kPixels, options);
      const auto summary = ProjectNonNegative(solver, Rows(c, 99).data(), kPixels, options);
      EXPECT_EQ(summary.unconverged, 0u);
      for (std::size_t k = 0; k < c.size(); ++k) {
        const double expected = k % kPixels == 5 ? before[k] : alone[k];
        if (std::isnan(expected))
          EXPECT_TRUE(std::isnan(c[k])) << "coefficient " << k;
        else
          EXPECT_EQ(c[k], expected) << "coefficient " << k;
      }
    }
}

TEST(NonNegative, ReportsWhatDidNotConverge) {
  const GramSolver solver = Solver(11, 9);
  std::vector<double> c = RandomCoefficients(99, 4, 0);
  const NonNegativeSummary summary =
      ProjectNonNegative(solver, Rows(c, 99).data(), 4, {false, false, 1e-14, 8});
  EXPECT_EQ(summary.unconverged, 4u);
  EXPECT_EQ(summary.iterations, 8);
  EXPECT_GT(summary.worst_residual, 1e-14);
}

}  // namespace
}  // namespace luxfield::reconstruct
