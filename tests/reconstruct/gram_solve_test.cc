#include "luxfield/reconstruct/solve/gram_solve.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::uint64_t kSeed = 20141;

BasisGrid Grid(BasisKind kind, int width, int height, double spacing_m = 0.0165) {
  BasisGrid grid;
  grid.basis = Basis::Make(kind);
  grid.width = width;
  grid.height = height;
  grid.spacing_m = spacing_m;
  return grid;
}

// The 2-D Gram matrix by brute force: trapezoids on the product of two basis functions (error of
// order 1/n^2), independent of the closed forms and of the factorisation.
Matrix BruteGram(const BasisGrid& grid, int count) {
  constexpr int kPerCell = 2000;
  const int cells = grid.basis.cells;
  const double dx = 1.0 / kPerCell;
  Matrix gram = Matrix::Zero(count, count);
  for (int offset = 0; offset < std::min(cells, count); ++offset) {
    double sum = 0;
    for (int n = 0; n < cells * kPerCell; ++n) {
      const double x = (n + 0.5) * dx;
      sum += grid.basis.Value(x) * grid.basis.Value(x - offset);
    }
    for (int i = 0; i + offset < count; ++i)
      gram(i, i + offset) = gram(i + offset, i) = sum * dx * grid.spacing_m;
  }
  return gram;
}

Matrix Kronecker(const Matrix& v, const Matrix& u) {  // index j * W + i
  Matrix result(v.rows() * u.rows(), v.cols() * u.cols());
  for (Eigen::Index j = 0; j < v.rows(); ++j)
    for (Eigen::Index n = 0; n < v.cols(); ++n)
      result.block(j * u.rows(), n * u.cols(), u.rows(), u.cols()) = v(j, n) * u;
  return result;
}

template <typename Storage, typename Work>
std::vector<Storage> Solve(const GramSolver& solver, const std::vector<Storage>& e,
                           std::size_t pixels) {
  std::vector<Storage> c(e.size());
  std::vector<const Storage*> in;
  std::vector<Storage*> out;
  for (int m = 0; m < solver.count(); ++m) {
    in.push_back(e.data() + m * pixels);
    out.push_back(c.data() + m * pixels);
  }
  solver.Solve<Storage, Work>(in.data(), out.data(), pixels);
  return c;
}

template <typename Storage>
double RelativeError(const std::vector<Storage>& a, const Matrix& reference) {
  double error = 0, norm = 0;
  for (Eigen::Index k = 0; k < reference.size(); ++k) {
    const double r = reference.data()[k];
    error += (a[k] - r) * (a[k] - r);
    norm += r * r;
  }
  return std::sqrt(error / norm);
}

struct Case {
  BasisKind kind;
  int width, height;
  std::size_t pixels;
};

class DenseReference : public testing::TestWithParam<Case> {};

TEST_P(DenseReference, AgreesInFloatAndDouble) {
  const Case param = GetParam();
  const BasisGrid grid = Grid(param.kind, param.width, param.height);
  const GramSolver solver(grid);
  const Matrix gram = Kronecker(BruteGram(grid, param.height), BruteGram(grid, param.width));
  core::Random random(kSeed, 1);
  Matrix e(gram.rows(), param.pixels);
  for (Eigen::Index k = 0; k < e.size(); ++k) e.data()[k] = random.Normal();
  const Matrix c = gram.llt().solve(e);
  const std::vector<double> e_double(e.data(), e.data() + e.size());
  const std::vector<float> e_float(e_double.begin(), e_double.end());
  // The midpoint reference is good to (1/2000)^2 / 12 times the second derivatives, amplified by
  // the condition number.
  EXPECT_LT(RelativeError(Solve<double, double>(solver, e_double, param.pixels), c),
            1e-7 * solver.condition());
  // float: a few units in the last place (6e-8), amplified by at most the condition number.
  EXPECT_LT(RelativeError(Solve<float, float>(solver, e_float, param.pixels), c),
            3e-7 * solver.condition());
  EXPECT_LT(RelativeError(Solve<float, double>(solver, e_float, param.pixels), c),
            2e-7 * solver.condition());
}

INSTANTIATE_TEST_SUITE_P(
    Sizes, DenseReference,
    testing::Values(Case{BasisKind::kBox, 5, 4, 3}, Case{BasisKind::kBilinear, 11, 9, 130},
                    Case{BasisKind::kQuadratic, 9, 7, 128}, Case{BasisKind::kBspline2, 1, 1, 1},
                    Case{BasisKind::kBspline2, 2, 1, 129}, Case{BasisKind::kBspline2, 1, 5, 7},
                    Case{BasisKind::kBspline2, 11, 9, 300}, Case{BasisKind::kBspline2, 23, 15, 5}));

TEST(GramSolver, BringsBackCoefficientsOf64By64Filters) {
  const GramSolver solver(Grid(BasisKind::kBspline2, 64, 64));
  core::Random random(kSeed, 2);
  constexpr std::size_t kPixels = 3;
  std::vector<double> c(64 * 64 * kPixels), e(c.size());
  for (double& x : c) x = random.Uniform();
  for (std::size_t p = 0; p < kPixels; ++p) {
    std::vector<double> pixel(64 * 64), forward(64 * 64);
    for (std::size_t m = 0; m < pixel.size(); ++m) pixel[m] = c[m * kPixels + p];
    // E = G_u C G_v^T written as plain sums.
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i)
        for (int n = std::max(0, j - 2); n <= std::min(63, j + 2); ++n)
          for (int m = std::max(0, i - 2); m <= std::min(63, i + 2); ++m)
            forward[j * 64 + i] +=
                solver.u().gram[i * 64 + m] * solver.v().gram[j * 64 + n] * pixel[n * 64 + m];
    for (std::size_t m = 0; m < pixel.size(); ++m) e[m * kPixels + p] = forward[m];
    std::vector<double> again(64 * 64);
    solver.Forward(pixel.data(), again.data());
    for (std::size_t m = 0; m < again.size(); ++m)
      EXPECT_NEAR(again[m], forward[m], 1e-14 * 2.8e-4);
  }
  const std::vector<double> solved = Solve<double, double>(solver, e, kPixels);
  const std::vector<float> solved_float =
      Solve<float, float>(solver, std::vector<float>(e.begin(), e.end()), kPixels);
  for (std::size_t k = 0; k < c.size(); ++k) {
    ASSERT_NEAR(solved[k], c[k], 1e-13 * 56);
    ASSERT_NEAR(solved_float[k], c[k], 1e-6 * 56);
  }
}

TEST(GramSolver, SolvesInPlaceAndWithoutRegardToThreads) {
  const GramSolver solver(Grid(BasisKind::kBspline2, 7, 5));
  core::Random random(kSeed, 3);
  constexpr std::size_t kPixels = 5000;
  std::vector<float> e(35 * kPixels);
  for (float& x : e) x = static_cast<float>(random.Normal());
  const std::vector<float> apart = Solve<float, float>(solver, e, kPixels);
  std::vector<float*> images;
  for (int m = 0; m < 35; ++m) images.push_back(e.data() + m * kPixels);
  solver.Solve<float, float>(images.data(), images.data(), kPixels);
  EXPECT_EQ(apart, e);
}

// The gains of a map that keeps moments: its root mean square row and its largest singular value, by
// another decomposition.
TEST(GramSolver, GainsAreThoseOfTheMapThatKeepsMoments) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const GramSolver solver(Grid(BasisKind::kBspline2, 7, 5), {2, 1});
  for (const GramAxis* axis : {&solver.u(), &solver.v()}) {
    ASSERT_GT(axis->moments, 0);
    const Eigen::MatrixXd map =
        Eigen::Map<const RowMajor>(axis->map.data(), axis->count, axis->count);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(map);
    EXPECT_NEAR(axis->worst_gain() / svd.singularValues()(0), 1, 1e-10);
    EXPECT_NEAR(axis->noise_gain() / (map.norm() / std::sqrt(axis->count)), 1, 1e-10);
  }
}

TEST(GramSolver, HasTheConditionAndGainsOfTheory) {
  const GramSolver small(Grid(BasisKind::kBspline2, 11, 9, 1.0)),
      large(Grid(BasisKind::kBspline2, 64, 64, 1.0));
  EXPECT_NEAR(small.noise_gain(), 10.7, 0.05);    // docs/theory.md 4
  EXPECT_NEAR(large.u().condition(), 7.5, 0.05);  // limit 1 / (16/120)
  EXPECT_LT(large.u().condition(), 7.5);
  EXPECT_NEAR(large.noise_gain(), 12.4, 0.4);
  EXPECT_NEAR(large.worst_gain(), 56.25, 0.6);
  EXPECT_NEAR(small.worst_gain(), 45, 2);  // docs/theory.md 4
  // The spacing scales G by h per axis and leaves the condition alone.
  const GramSolver scaled(Grid(BasisKind::kBspline2, 11, 9, 0.01));
  EXPECT_NEAR(scaled.condition(), small.condition(), 1e-9);
  EXPECT_NEAR(scaled.noise_gain() * 1e-4, small.noise_gain(), 1e-9);
}

TEST(GramSolver, RefusesTwoFiltersInOnePlaceByName) {
  // Filters at 0, 1, 1 and 2: rows 1 and 2 are equal.
  const Basis basis = Basis::Make(BasisKind::kBspline2);
  const double at[] = {0, 1, 1, 2};
  std::vector<double> gram;
  for (const double a : at)
    for (const double b : at) gram.push_back(basis.Gram(b - a));
  try {
    GramAxis::Factor(gram, 4, "u");
    FAIL() << "a singular matrix was factorised";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "filters 1 and 2 along u sit in one place: the Gram matrix is singular; move or "
                 "drop one of them");
  }
}

// A border that clips `cut` spacings of the outer supports, 11 x 9 filters. Each axis alone would
// pass at 2.9 spacings: the product decides.
GramSolver Clipped(double cut) {
  const auto axis = [cut](int count, const char* name) {
    return GramAxis::Factor(lightfield::GramMatrixClipped(Basis::Make(BasisKind::kBspline2), count,
                                                          1, cut, count + 2 - cut),
                            count, name);
  };
  return GramSolver(axis(11, "u"), axis(9, "v"));
}

TEST(GramSolver, RefusesWhatOnlyBothAxesTogetherMakeSingular) {
  EXPECT_LT(Clipped(1.9).condition(), kLargestCondition);
  try {
    Clipped(2.9);
    FAIL() << "a system of condition 7e12 was accepted";
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("e+12"), std::string::npos) << what;
    EXPECT_NE(what.find("leave out the outer filters"), std::string::npos) << what;
  }
}

TEST(GramSolver, RefusesMatricesThatAreNoGramMatrix) {
  EXPECT_THROW(GramAxis::Factor({1, 2, 3, 4}, 2, "u"), InputError);    // not symmetric
  EXPECT_THROW(GramAxis::Factor({1, 0, 0, NAN}, 2, "u"), InputError);  // not finite
  EXPECT_THROW(GramAxis::Factor({1, 2, 2, 1}, 2, "u"), InputError);    // indefinite
  EXPECT_THROW(GramAxis::Factor({1, 0, 0}, 2, "u"), InputError);       // wrong size
  EXPECT_THROW(GramAxis::Factor({1, 0, 0, .1, 0, 1, 0, 0, 0, 0, 1, 0, .1, 0, 0, 1}, 4, "u"),
               InputError);  // band
}

TEST(GramSolver, SpacingOffByAMillionthScalesTheSolution) {
  // G is proportional to h per axis: C is off by 2e-6, not by 2e-6 times the condition number.
  const GramSolver right(Grid(BasisKind::kBspline2, 11, 9, 0.0165));
  const GramSolver off(Grid(BasisKind::kBspline2, 11, 9, 0.0165 * (1 + 1e-6)));
  core::Random random(kSeed, 4);
  std::vector<double> e(99);
  for (double& x : e) x = random.Normal();
  const std::vector<double> a = Solve<double, double>(right, e, 1),
                            b = Solve<double, double>(off, e, 1);
  for (std::size_t m = 0; m < 99; ++m) EXPECT_NEAR(b[m], a[m] * (1 - 2e-6), 1e-9 * std::abs(a[m]));
}

TEST(GramSolver, AmplifiesWhiteNoiseByItsGain) {
  const GramSolver solver(Grid(BasisKind::kBspline2, 11, 9, 1.0));
  core::Random random(kSeed, 5);
  constexpr std::size_t kPixels = 4000;
  std::vector<float> e(99 * kPixels);
  for (float& x : e) x = static_cast<float>(random.Normal());
  const std::vector<float> c = Solve<float, float>(solver, e, kPixels);
  double sum = 0;
  for (const float x : c) sum += static_cast<double>(x) * x;
  // 4000 pixels with at least 10 effective degrees of freedom each: 4 standard errors are 1.4 % of
  // the RMS.
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(c.size())), solver.noise_gain(),
              0.015 * solver.noise_gain());
}

}  // namespace
}  // namespace luxfield::reconstruct
