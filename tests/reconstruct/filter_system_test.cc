#include "luxfield/reconstruct/solve/filter_system.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/general_solve.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::MeasuredFilter;
using lightfield::Measurement;
using lightfield::Measurements;
using lightfield::Vec2;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::uint64_t kSeed = 2718;
constexpr double kSpacing_m = 0.0165;

BasisGrid Grid(int width, int height, BasisKind kind = BasisKind::kBspline2) {
  return BasisGrid::Centred(Basis::Make(kind), width, height, kSpacing_m);
}

std::vector<Vec2> Centres(const BasisGrid& grid, double error_m = 0) {
  std::vector<Vec2> centres;
  core::Random random(kSeed, 1);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      centres.push_back(grid.centre(i, j) + error_m * Vec2{random.Normal(), random.Normal()});
  return centres;
}

// A print with errors, of Phi or of a part of its dual function.
struct Print {
  Vec2 shift_m;
  double rotation_rad = 0, density = 0, gamma = 0;

  double operator()(const BasisGrid& grid, Vec2 x) const {
    const Vec2 own = Own(grid, x);
    const double half = 0.5 * grid.basis.cells;
    return Printed(grid.basis.Value(own.x + half) * grid.basis.Value(own.y + half));
  }
  // Of `sign` times the dual function.
  double Part(const BasisGrid& grid, Vec2 x, int sign) const {
    const Vec2 own = Own(grid, x);
    const double peak = grid.basis.DualPeaks()[sign > 0 ? 0 : 1];
    const double dual = grid.basis.DualValue(own.x) * grid.basis.DualValue(own.y);
    return Printed(std::max(sign * dual, 0.0) / peak);
  }

 private:
  Vec2 Own(const BasisGrid& grid, Vec2 x) const {  // in spacings
    const double c = std::cos(rotation_rad), s = std::sin(rotation_rad);
    const Vec2 d = x - shift_m;
    return {(c * d.x + s * d.y) / grid.spacing_m, (-s * d.x + c * d.y) / grid.spacing_m};
  }
  double Printed(double meant) const { return (1 + density) * std::pow(meant, 1 + gamma); }
};

// The two prints of a pair, each with its own errors.
struct Pair {
  Print plus, minus;

  double operator()(const BasisGrid& grid, Vec2 x) const {
    const auto peaks = grid.basis.DualPeaks();
    return peaks[0] * plus.Part(grid, x, 1) - peaks[1] * minus.Part(grid, x, -1);
  }
};

MeasuredFilter OpenFilter(const BasisGrid& grid, int texels_per_spacing) {
  MeasuredFilter filter;
  filter.basis = grid.basis;
  filter.spacing_m = grid.spacing_m;
  const double texel_m = grid.spacing_m / texels_per_spacing;
  const int size = texels_per_spacing * (grid.basis.cells + 1);
  filter.lattice = {size, size, -0.5 * size * texel_m, 0.5 * size * texel_m, texel_m, texel_m};
  return filter;
}

// Texel means by 4 x 4 points.
template <typename Transmittance>
void AddPrint(const Transmittance& transmittance, MeasuredFilter* filter) {
  auto& p = filter->prints.emplace_back();
  const auto& lattice = filter->lattice;
  for (int row = 0; row < lattice.height; ++row)
    for (int column = 0; column < lattice.width; ++column) {
      double sum = 0;
      for (int k = 0; k < 16; ++k)
        sum += transmittance(Vec2{lattice.s_of_column(column + (k % 4 + 0.5) / 4),
                                  lattice.t_of_row(row + (k / 4 + 0.5) / 4)});
      p.transmittance.push_back(static_cast<float>(sum / 16));
    }
  p.sigma.assign(p.transmittance.size(), 0.001f);
}

MeasuredFilter Measured(const BasisGrid& grid, const Print& print, int texels_per_spacing = 64) {
  MeasuredFilter filter = OpenFilter(grid, texels_per_spacing);
  AddPrint([&](Vec2 x) { return print(grid, x); }, &filter);
  return filter;
}

MeasuredFilter Measured(const BasisGrid& grid, const Pair& pair, int texels_per_spacing = 64) {
  MeasuredFilter filter = OpenFilter(grid, texels_per_spacing);
  filter.filter = FilterKind::kDual;
  AddPrint([&](Vec2 x) { return pair.plus.Part(grid, x, 1); }, &filter);
  AddPrint([&](Vec2 x) { return pair.minus.Part(grid, x, -1); }, &filter);
  return filter;
}

// As pixels of three texels would show it: means over them, spread over them again.
MeasuredFilter SeenByPixels(MeasuredFilter filter) {
  for (auto& print : filter.prints)
    for (const int step : {1, 1, filter.lattice.width, filter.lattice.width}) {
      const auto sharp = print.transmittance;
      for (std::size_t k = step; k + step < sharp.size(); ++k)
        print.transmittance[k] = (sharp[k - step] + sharp[k] + sharp[k + step]) / 3;
    }
  filter.blur_m = std::sqrt(4.0 / 3) * filter.lattice.ds_m;
  return filter;
}

// Prints that err, each in its own way.
const Pair kWrongPair{{{3e-4, -2e-4}, 0.01, 0.02, 0.05}, {{-1e-4, 2e-4}, -0.005, -0.03, 0.02}};

// Entries by the midpoint rule over F, 200 points per spacing and axis, of a Print or a Pair.
template <typename Filter>
Matrix BruteForce(const BasisGrid& grid, const Filter& filter, const std::vector<Vec2>& centres) {
  Matrix a = Matrix::Zero(static_cast<Eigen::Index>(centres.size()), grid.count());
  constexpr int kPerSpacing = 200;
  const double step = grid.spacing_m / kPerSpacing, reach = 0.5 * (grid.basis.cells + 1);
  const int points = static_cast<int>(2 * reach * kPerSpacing);
  for (Eigen::Index r = 0; r < a.rows(); ++r)
    for (int y = 0; y < points; ++y)
      for (int x = 0; x < points; ++x) {
        const Vec2 offset{-reach * grid.spacing_m + (x + 0.5) * step,
                          -reach * grid.spacing_m + (y + 0.5) * step};
        const double t = filter(grid, offset);
        if (t == 0) continue;
        const Vec2 u = centres[r] + offset;
        for (int m = 0; m < grid.count(); ++m)
          a(r, m) += t * grid.Phi(m % grid.width, m / grid.width, u) * step * step;
      }
  return a;
}

Matrix Dense(const FilterSystem& system) {
  const std::vector<double> dense = system.Dense();
  return Eigen::Map<const Matrix>(dense.data(), system.rows(), system.columns());
}

TEST(FilterSystem, EntriesOfAMeasuredPrintAreItsInnerProducts) {
  const BasisGrid grid = Grid(3, 2);
  const std::vector<Vec2> centres = Centres(grid, 0.05 * kSpacing_m);
  const Print print{{3e-4, -2e-4}, 0.01, 0.02, 0.05};
  const MeasuredFilter filter = Measured(grid, print);
  const Matrix expected = BruteForce(grid, print, centres);
  // Texels of h / 64 blur entries by 8e-5: (1/64)^2 / 12 times |B'|^2 / |B|^2 = 1.8 per axis. That
  // is taken back; the midpoint rule and the 16 points of a texel leave some 1e-6.
  EXPECT_LT((Dense(FilterSystem(grid, &filter, centres)) - expected).norm(),
            1e-5 * expected.norm());
}

// What is left is of fourth order, of the pair, where slopes of both functions jump, of third.
TEST(FilterSystem, WhatPixelsBlurIsTakenBack) {
  const BasisGrid grid = Grid(3, 2), of_pair = Grid(3, 2, BasisKind::kQuadratic);
  const Print& print = kWrongPair.plus;
  const auto error = [](const BasisGrid& g, const MeasuredFilter& seen, const auto& truth) {
    const std::vector<Vec2> centres = Centres(g, 0.05 * kSpacing_m);
    const Matrix a = BruteForce(g, truth, centres);
    return (Dense(FilterSystem(g, &seen, centres)) - a).norm() / a.norm();
  };
  auto seen = SeenByPixels(Measured(grid, print)),
       pair = SeenByPixels(Measured(of_pair, kWrongPair));
  EXPECT_LT(error(grid, seen, print), 5e-6);
  EXPECT_LT(error(of_pair, pair, kWrongPair), 8e-5);
  seen.blur_m = pair.blur_m = 0;
  EXPECT_NEAR(error(grid, seen, print), 5.2e-4, 1e-4);
  EXPECT_NEAR(error(of_pair, pair, kWrongPair), 2.4e-3, 3e-4);
}

TEST(FilterSystem, EntriesOfAMeasuredPairAreTheInnerProductsOfItsDifference) {
  for (const BasisKind kind : {BasisKind::kBilinear, BasisKind::kQuadratic}) {
    const BasisGrid grid = Grid(3, 2, kind);
    const std::vector<Vec2> centres = Centres(grid, 0.05 * kSpacing_m);
    const MeasuredFilter filter = Measured(grid, kWrongPair);
    const Matrix expected = BruteForce(grid, kWrongPair, centres);
    // 3.2e-4 were it not taken back: (1/64)^2 / 12 times the integral of B*' B', 7.8 for quadratic,
    // per axis. Slopes of both jump, which is of third order.
    EXPECT_LT((Dense(FilterSystem(grid, &filter, centres)) - expected).norm(),
              4e-5 * expected.norm());
  }
}

// <Phi*_i, Phi_m> = h^2 delta_im: nothing to solve, whatever the number of filters.
TEST(FilterSystem, AnIdealPairAsMeasuredIsTheIdentity) {
  for (const BasisKind kind : {BasisKind::kBilinear, BasisKind::kQuadratic}) {
    const BasisGrid grid = Grid(7, 5, kind);
    const MeasuredFilter filter = Measured(grid, Pair{});
    const FilterSystem system(grid, &filter, Centres(grid));
    const double h2 = kSpacing_m * kSpacing_m;
    const Matrix identity = Matrix::Identity(grid.count(), grid.count());
    EXPECT_LT((Dense(system) / h2 - identity).norm(), 1e-3 * identity.norm());
    EXPECT_NEAR(system.condition(), 1, 2e-3);
    EXPECT_NEAR(system.noise_gain() * h2, 1, 1e-3);
    EXPECT_TRUE(system.Separable(1e-6).has_value());
  }
}

TEST(FilterSystem, DisplacedIdealFiltersOverlapAsClosedFormsSay) {
  for (const BasisKind kind : {BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const BasisGrid grid = Grid(3, 3, kind);
    const std::vector<Vec2> centres = Centres(grid, 0.05 * kSpacing_m);
    const Matrix expected = BruteForce(grid, Print{}, centres);
    EXPECT_LT((Dense(FilterSystem(grid, nullptr, centres)) - expected).norm(),
              3e-5 * expected.norm());
  }
}

TEST(FilterSystem, DualFiltersMeetTheirNeighboursWhereTheyAreDisplaced) {
  const BasisGrid grid = Grid(4, 3, BasisKind::kQuadratic);
  const double h2 = kSpacing_m * kSpacing_m;
  const Matrix placed = Dense(FilterSystem(grid, nullptr, Centres(grid), FilterKind::kDual));
  EXPECT_LT((placed / h2 - Matrix::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-12);
  const std::vector<Vec2> centres = Centres(grid, 0.04 * kSpacing_m);
  const Matrix a = Dense(FilterSystem(grid, nullptr, centres, FilterKind::kDual));
  // By the midpoint rule: the filter a distance x from a basis function.
  const auto overlap = [&](double x) {
    constexpr int kPoints = 20000;
    double sum = 0;
    for (int k = 0; k < kPoints; ++k) {
      const double t = -1 + 2 * (k + 0.5) / kPoints;
      sum += grid.basis.DualValue(t) * grid.basis.Value(t + x + 1);
    }
    return 2 * sum / kPoints;
  };
  for (int r = 0; r < 12; ++r)
    for (int m = 0; m < 12; ++m) {
      const Vec2 off = (1 / kSpacing_m) * (centres[r] - grid.centre(m % 4, m / 4));
      EXPECT_NEAR(a(r, m) / h2, overlap(off.x) * overlap(off.y), 1e-7) << r << ' ' << m;
    }
}

TEST(FilterSystem, SingularValuesAndInverseAgreeWithADenseDecomposition) {
  const BasisGrid grid = Grid(9, 7);
  const MeasuredFilter filter = Measured(grid, Print{{2e-4, 1e-4}, 0.005, 0.02, 0.03}, 16);
  std::vector<Vec2> centres = Centres(grid, 0.02 * kSpacing_m);
  for (const bool twice : {false, true}) {
    if (twice) {  // over-determined
      const auto more = Centres(grid, 0.1 * kSpacing_m);
      centres.insert(centres.end(), more.begin(), more.end());
    }
    const FilterSystem system(grid, &filter, centres);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(Dense(system)),
                                                Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd values = svd.singularValues();
    EXPECT_NEAR(system.largest_singular_value() / values(0), 1, 1e-9);
    EXPECT_NEAR(system.smallest_singular_value() / values(values.size() - 1), 1, 1e-9);
    const Matrix inverse =
        svd.matrixV() * values.cwiseInverse().asDiagonal() * svd.matrixU().transpose();
    const Eigen::Map<const Matrix> ours(system.PseudoInverse().data(), system.columns(),
                                        system.rows());
    EXPECT_LT((ours - inverse).norm(), 1e-11 * inverse.norm());
    EXPECT_NEAR(system.noise_gain(), inverse.norm() / std::sqrt(63), 1e-10 * system.noise_gain());
  }
}

TEST(FilterSystem, IdealFiltersAtTheirPlacesAreTheGramMatrix) {
  const BasisGrid grid = Grid(11, 9);
  const FilterSystem system(grid, nullptr, Centres(grid));
  const GramSolver solver(grid);
  EXPECT_NEAR(system.condition() / solver.condition(), 1, 1e-9);
  EXPECT_NEAR(system.noise_gain() / solver.noise_gain(), 1, 1e-9);
  const auto separable = system.Separable(1e-6);
  ASSERT_TRUE(separable.has_value());
  Matrix product(99, 99);
  for (int r = 0; r < 99; ++r)
    for (int m = 0; m < 99; ++m)
      product(r, m) = separable->u[r % 11 * 11 + m % 11] * separable->v[r / 11 * 9 + m / 11];
  EXPECT_LT((product - Dense(system)).norm(), 1e-14 * product.norm());
}

// Which path holds: a density error and a shift keep the print separable; a rotation, a tone curve
// that mixes the axes, or positions that each err in their own way do not.
TEST(FilterSystem, KnowsWhenItIsSeparable) {
  const BasisGrid grid = Grid(5, 4);
  const auto separable = [&](const Print& print, double error_m) {
    const MeasuredFilter filter = Measured(grid, print, 32);
    return FilterSystem(grid, &filter, Centres(grid, error_m)).Separable(1e-6).has_value();
  };
  EXPECT_TRUE(separable({{3e-4, -2e-4}, 0, 0.02, 0}, 0));
  EXPECT_TRUE(separable({{0, 0}, 0, 0, 0.1}, 0));  // a power of a product is a product
  EXPECT_FALSE(separable({{0, 0}, 0.01, 0, 0}, 0));
  EXPECT_FALSE(separable({}, 1e-4));
}

// Noise of the texels, propagated, against its spread over 200 drawn filters.
void ExpectMatrixNoiseIsItsSpread(const BasisGrid& grid, MeasuredFilter filter) {
  constexpr float kSigma = 0.05f;
  const std::vector<lightfield::MeasuredPrint> prints = filter.prints;
  for (auto& print : filter.prints) std::fill(print.sigma.begin(), print.sigma.end(), kSigma);
  const FilterSystem clean(grid, &filter, Centres(grid));
  const Matrix a = Dense(clean);
  double squares = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    core::Random random(kSeed, 100 + run);
    for (std::size_t p = 0; p < prints.size(); ++p)
      for (std::size_t k = 0; k < prints[p].transmittance.size(); ++k)
        filter.prints[p].transmittance[k] =
            prints[p].transmittance[k] + static_cast<float>(kSigma * random.Normal());
    squares += (Dense(FilterSystem(grid, &filter, Centres(grid))) - a).squaredNorm() / kRuns;
  }
  // Neighbouring entries share texels: count 200 runs of some 20 independent ones.
  EXPECT_NEAR(std::sqrt(squares) / a.norm() / clean.matrix_noise(), 1, 5 / std::sqrt(2.0 * 4000));
}

TEST(FilterSystem, MatrixNoiseIsTheSpreadOverNoisyPhotographs) {
  ExpectMatrixNoiseIsItsSpread(Grid(3, 3), Measured(Grid(3, 3), Print{}, 8));
  // Of a pair the noise of both, mostly that of the plus part: the factors' squares.
  const BasisGrid dual = Grid(3, 3, BasisKind::kQuadratic);
  ExpectMatrixNoiseIsItsSpread(dual, Measured(dual, Pair{}, 16));
}

std::string RefusalOf(const BasisGrid& grid, const MeasuredFilter* filter,
                      const std::vector<Vec2>& centres) {
  try {
    FilterSystem(grid, filter, centres);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(FilterSystem, RefusesByName) {
  using testing::HasSubstr;
  const BasisGrid grid = Grid(4, 3);
  std::vector<Vec2> centres = Centres(grid);
  EXPECT_EQ(RefusalOf(grid, nullptr, centres), "");
  centres[6] = centres[5];
  EXPECT_THAT(RefusalOf(grid, nullptr, centres),
              HasSubstr("filter positions (1, 1) and (2, 1) sit in one place"));
  centres.pop_back();
  EXPECT_THAT(RefusalOf(grid, nullptr, centres), HasSubstr("11 filter positions for 12"));
  MeasuredFilter filter = Measured(grid, Print{}, 8);
  filter.spacing_m *= 1.001;
  EXPECT_THAT(RefusalOf(grid, &filter, Centres(grid)), HasSubstr("spacing 0.0165"));
  filter = Measured(grid, Print{}, 8);
  filter.basis = Basis::Make(BasisKind::kBox);
  EXPECT_THAT(RefusalOf(grid, &filter, Centres(grid)), HasSubstr("is of basis 'box'"));
  filter = Measured(grid, Print{}, 8);
  std::fill(filter.prints[0].transmittance.begin(), filter.prints[0].transmittance.end(), 0.0f);
  EXPECT_THAT(RefusalOf(grid, &filter, Centres(grid)), HasSubstr("opaque"));
}

// Measurements behind the given print at the given centres of a luminaire with C of its own per
// texel, with relative noise.
Measurements Measure(const BasisGrid& grid, const Matrix& a, const Matrix& c, int size,
                     double noise, std::uint64_t stream, FilterKind kind = FilterKind::kBasis) {
  Measurements result;
  result.filter = kind;
  result.geometry.delta_m = 0.3;
  result.geometry.grid = grid;
  result.geometry.lattice = {size, size, -0.1, 0.1, 0.2 / size, 0.2 / size};
  const Matrix e = a * c;
  const double level = std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
  for (Eigen::Index r = 0; r < e.rows(); ++r) {
    Measurement& position = result.positions.emplace_back();
    core::Random random(kSeed, stream, static_cast<std::uint32_t>(r));
    for (Eigen::Index p = 0; p < e.cols(); ++p) {
      const double sigma = noise * level * (1 + random.Uniform());
      position.irradiance.push_back(static_cast<float>(e(r, p) + sigma * random.Normal()));
      position.sigma.push_back(static_cast<float>(sigma));
    }
    position.count.assign(e.cols(), 1);
    position.mask.assign(e.cols(), 0);
  }
  return result;
}

Matrix RandomCoefficients(const BasisGrid& grid, int size, std::uint64_t stream) {
  Matrix c(grid.count(), size * size);
  core::Random random(kSeed, stream);
  for (Eigen::Index k = 0; k < c.size(); ++k) c.data()[k] = 1000 * random.Uniform();
  return c;
}

double RelativeError(const Reconstruction& result, const Matrix& c) {
  const Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
      ours(result.coefficients.data.data(), c.rows(), c.cols());
  return (ours.cast<double>() - c).norm() / c.norm();
}

TEST(ReconstructWithFilter, BringsBackWhatDisplacedPrintsSaw) {
  const BasisGrid grid = Grid(5, 4);
  constexpr int kSize = 6;
  const Matrix c = RandomCoefficients(grid, kSize, 20);
  for (const bool displaced : {false, true}) {
    const std::vector<Vec2> centres = Centres(grid, displaced ? 0.02 * kSpacing_m : 0);
    const Print print{{0.01 * kSpacing_m, 0}, 0, 0.02, 0};
    const MeasuredFilter filter = Measured(grid, print, 32);
    Measurements measurements =
        Measure(grid, Dense(FilterSystem(grid, &filter, centres)), c, kSize, 1e-9, 21);
    const std::vector<Vec2> planned = Centres(grid);
    for (std::size_t m = 0; m < planned.size(); ++m)
      measurements.positions[m].displacement_m = centres[m] - planned[m];
    ReconstructOptions options;
    options.filter = &filter;
    const Reconstruction result = Reconstruct(measurements, options);
    EXPECT_EQ(result.report.solve, displaced ? "general" : "separable");
    EXPECT_LT(RelativeError(result, c), 5e-6);  // float E times the noise gain
    const FilterSystem system(grid, &filter, centres);
    EXPECT_NEAR(result.report.condition / system.condition(), 1, 1e-9);
    // Believing in ideal filters at planned places costs what the print and the stage err.
    for (Measurement& position : measurements.positions) position.displacement_m = {};
    EXPECT_GT(RelativeError(Reconstruct(measurements), c), 0.02);
  }
}

// A pair that errs, and a stage that does: taken for ideal ones C is wrong, by the forward model of
// the difference it is not.
TEST(ReconstructWithFilter, BringsBackWhatAWrongPairSaw) {
  const BasisGrid grid = Grid(5, 4, BasisKind::kQuadratic);
  constexpr int kSize = 6;
  const Matrix c = RandomCoefficients(grid, kSize, 25);
  const MeasuredFilter filter = Measured(grid, kWrongPair, 32);
  ReconstructOptions options;
  options.filter = &filter;
  for (const bool displaced : {false, true}) {
    const auto centres = Centres(grid, displaced ? 0.02 * kSpacing_m : 0), planned = Centres(grid);
    const FilterSystem system(grid, &filter, centres);
    Measurements measurements = Measure(grid, Dense(system), c, kSize, 1e-9, 26, FilterKind::kDual);
    for (std::size_t m = 0; m < planned.size(); ++m)
      measurements.positions[m].displacement_m = centres[m] - planned[m];
    const Reconstruction result = Reconstruct(measurements, options);
    EXPECT_EQ(result.report.solve, "general");
    EXPECT_LT(RelativeError(result, c), 1e-6);  // float E; the noise gain is about 1
    EXPECT_NEAR(result.report.condition / system.condition(), 1, 1e-9);
    EXPECT_LT(result.report.condition, 1.5);
    const Reconstruction assumed = Reconstruct(measurements);
    EXPECT_EQ(assumed.report.solve, displaced ? "general" : "none");
    EXPECT_GT(RelativeError(assumed, c), 0.02);
  }
}

TEST(ReconstructWithFilter, BringsBackWhatDisplacedDualFiltersSaw) {
  const BasisGrid grid = Grid(5, 4, BasisKind::kQuadratic);
  constexpr int kSize = 6;
  const Matrix c = RandomCoefficients(grid, kSize, 24);
  const std::vector<Vec2> centres = Centres(grid, 0.03 * kSpacing_m), planned = Centres(grid);
  const Matrix a = Dense(FilterSystem(grid, nullptr, centres, FilterKind::kDual));
  Measurements measurements = Measure(grid, a, c, kSize, 1e-9, 25, FilterKind::kDual);
  Measurements displaced = measurements;
  for (std::size_t m = 0; m < planned.size(); ++m)
    displaced.positions[m].displacement_m = centres[m] - planned[m];
  const Reconstruction result = Reconstruct(displaced);
  EXPECT_EQ(result.report.solve, "general");
  EXPECT_LT(RelativeError(result, c), 2e-6);
  EXPECT_GT(result.report.condition, 1.01);
  // E / h^2 takes the filters to have stood where they were planned.
  const Reconstruction as_planned = Reconstruct(measurements);
  EXPECT_EQ(as_planned.report.solve, "none");
  EXPECT_GT(RelativeError(as_planned, c), 0.005);
  // Two sessions of one plan count by their noise.
  Measurements poor = Measure(grid, a, c, kSize, 0.1, 26, FilterKind::kDual);
  for (std::size_t m = 0; m < planned.size(); ++m)
    poor.positions[m].displacement_m = centres[m] - planned[m];
  const Measurements both[] = {displaced, poor};
  EXPECT_LT(RelativeError(Reconstruct(both), c), 1e-5);
}

void ExpectSigmaIsTheSpread(const BasisGrid& grid, const MeasuredFilter& filter) {
  constexpr int kSize = 40;  // 1600 texels are so many runs
  const Matrix c = RandomCoefficients(grid, kSize, 30);
  ReconstructOptions options;
  options.filter = &filter;
  for (const bool displaced : {false, true}) {
    const auto centres = Centres(grid, displaced ? 0.02 * kSpacing_m : 0), planned = Centres(grid);
    std::vector<Measurements> all;
    for (int session = 0; session < 2; ++session) {
      all.push_back(Measure(grid, Dense(FilterSystem(grid, &filter, centres)), c, kSize, 0.01,
                            31 + session, filter.filter));
      for (std::size_t m = 0; m < planned.size(); ++m)
        all.back().positions[m].displacement_m = centres[m] - planned[m];
    }
    // One session, then both together: over-determined, weighted.
    for (const std::size_t sessions : {1u, 2u}) {
      const Reconstruction result = Reconstruct(std::span(all).first(sessions), options);
      double square = 0;
      for (Eigen::Index m = 0; m < c.rows(); ++m)
        for (Eigen::Index p = 0; p < c.cols(); ++p) {
          const std::size_t at = m * c.cols() + p;
          const double d = (result.coefficients.data[at] - c(m, p)) / result.sigma.data[at];
          square += d * d / static_cast<double>(c.size());
        }
      // Errors of the 12 images of a texel are correlated: 1600 texels of chi-squared, 5 sigma.
      EXPECT_NEAR(square, 1, 5 * std::sqrt(2.0 / 1600)) << sessions << " sessions";
    }
  }
}

TEST(ReconstructWithFilter, SigmaIsTheSpreadOnEveryPath) {
  const BasisGrid grid = Grid(4, 3);
  ExpectSigmaIsTheSpread(grid, Measured(grid, Print{{3e-4, 0}, 0, 0.02, 0}, 16));
  const BasisGrid dual = Grid(4, 3, BasisKind::kQuadratic);
  ExpectSigmaIsTheSpread(dual, Measured(dual, kWrongPair, 16));
}

TEST(ReconstructWithFilter, WeightsHalveTheErrorWhereOneSessionIsPoor) {
  const BasisGrid grid = Grid(4, 3);
  constexpr int kSize = 20;
  const Matrix c = RandomCoefficients(grid, kSize, 40);
  const Matrix a = Dense(FilterSystem(grid, nullptr, Centres(grid)));
  const std::vector<Measurements> all{Measure(grid, a, c, kSize, 0.01, 41),
                                      Measure(grid, a, c, kSize, 0.1, 42)};
  const double good = RelativeError(Reconstruct(all[0]), c);
  // 1 / (1 + 0.1^2) of the variance is left; equal weights would give 5 times the error.
  EXPECT_NEAR(RelativeError(Reconstruct(std::span(all)), c) / good, 1 / std::sqrt(1.01), 0.05);
}

// The prior says how wrong the unknown parts are: C drawn from it, errors against sigma.
void ExpectSigmaCoversMissingPositions(const BasisGrid& grid, const MeasuredFilter* filter) {
  constexpr int kSize = 32;
  Matrix c(grid.count(), kSize * kSize);
  core::Random random(kSeed, 50);
  for (Eigen::Index k = 0; k < c.size(); ++k) c.data()[k] = 1000 * random.Normal();
  Measurements measurements =
      Measure(grid, Dense(FilterSystem(grid, filter, Centres(grid))), c, kSize, 0.001, 51,
              filter ? filter->filter : FilterKind::kBasis);
  ReconstructOptions options;
  options.filter = filter;
  for (std::size_t p = 0; p < kSize * kSize; ++p)
    for (int m = 0; m < grid.count(); ++m)
      if ((p % 3 == 0 && m % 6 < 2) || (p % 3 == 1 && (m * 7 + p) % 4 == 0 && m < 20)) {
        measurements.positions[m].mask[p] = lightfield::kOffSensor;
        measurements.positions[m].irradiance[p] = 0;
      }
  const Reconstruction result = Reconstruct(measurements, options);
  EXPECT_EQ(result.report.solve, filter ? "general" : "gram");
  EXPECT_GT(result.report.incomplete.incomplete, 600u);
  double square = 0, count = 0;
  for (std::size_t p = 0; p < kSize * kSize; ++p)
    if (result.unknown_positions[p] > 0)
      for (Eigen::Index m = 0; m < c.rows(); ++m) {
        const std::size_t at = m * c.cols() + p;
        const double d = (result.coefficients.data[at] - c(m, p)) / result.sigma.data[at];
        square += d * d;
        ++count;
      }
  // Some 680 texels with 4 to 10 unknown directions each; tau of 20 values scatters by
  // 1/sqrt(40), which makes the mean of 1/tau^2 about a tenth more than 1.
  EXPECT_GT(square / count, 0.9);
  EXPECT_LT(square / count, 1.25);
}

TEST(ReconstructWithFilter, SigmaOfMissingPositionsCoversTheirError) {
  const BasisGrid grid = Grid(6, 5), dual = Grid(6, 5, BasisKind::kQuadratic);
  ExpectSigmaCoversMissingPositions(grid, nullptr);
  const MeasuredFilter print = Measured(grid, Print{{3e-4, 0}, 0.01, 0.02, 0}, 16),
                       pair = Measured(dual, kWrongPair, 16);
  ExpectSigmaCoversMissingPositions(grid, &print);
  ExpectSigmaCoversMissingPositions(dual, &pair);
}

TEST(ReconstructWithFilter, RefusesWhatDoesNotBelongTogether) {
  const BasisGrid grid = Grid(3, 3);
  const Matrix c = RandomCoefficients(grid, 3, 60);
  const Matrix a = Dense(FilterSystem(grid, nullptr, Centres(grid)));
  std::vector<Measurements> all{Measure(grid, a, c, 3, 0.01, 61), Measure(grid, a, c, 3, 0.01, 62)};
  MeasuredFilter filter = Measured(grid, Print{}, 8);
  filter.filter_scale = 16.0 / 9;
  ReconstructOptions options;
  options.filter = &filter;
  EXPECT_THROW(Reconstruct(all[0], options), InputError);
  // A pair for a session of single prints.
  const BasisGrid dual = Grid(3, 3, BasisKind::kQuadratic);
  const MeasuredFilter pair = Measured(dual, Pair{}, 8);
  options.filter = &pair;
  EXPECT_THROW(Reconstruct(Measure(dual, a, c, 3, 0.01, 63), options), InputError);
  EXPECT_NO_THROW(Reconstruct(Measure(dual, a, c, 3, 0.01, 63, FilterKind::kDual), options));
  all[1].positions[3].sigma[2] = 0;
  EXPECT_THROW(Reconstruct(std::span(all)), InputError);
  all[1].geometry.lattice.ds_m *= 2;
  EXPECT_THROW(Reconstruct(std::span(all)), InputError);
  EXPECT_THROW(Reconstruct(std::span<const Measurements>()), InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
