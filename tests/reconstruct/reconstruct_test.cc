#include "luxfield/reconstruct/solve/reconstruct.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/missing_data.h"
#include "luxfield/reconstruct/solve/report_json.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::LuminaireGeometry;
using lightfield::Measurement;
using lightfield::Measurements;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::uint64_t kSeed = 41414;

LuminaireGeometry Geometry(int width, int height, int size, int channels,
                           BasisKind kind = BasisKind::kBspline2) {
  LuminaireGeometry geometry;
  geometry.delta_m = 0.3;
  geometry.grid = BasisGrid::Centred(Basis::Make(kind), width, height, 0.01);
  geometry.lattice = {size, size, -0.1, 0.1, 0.2 / size, 0.2 / size};
  geometry.channels = channels;
  return geometry;
}

// A smooth positive C with a bright spot that walks with the basis index.
double TrueCoefficient(const LuminaireGeometry& g, int m, int channel, std::size_t p) {
  const int i = m % g.grid.width, j = m / g.grid.width;
  const double x = static_cast<double>(p % g.lattice.width) / g.lattice.width;
  const double y = static_cast<double>(p / g.lattice.width) / g.lattice.height;
  const double cx = 0.3 + 0.04 * i, cy = 0.6 - 0.03 * j;
  return (1 + 0.3 * channel) * (1 + std::sin(0.7 * i) * std::cos(0.5 * j)) *
         (1000 * std::exp(-80 * ((x - cx) * (x - cx) + (y - cy) * (y - cy))) + 1);
}

// E by sums over the Gram entries of docs/theory.md 4, in double.
Measurements Measure(const LuminaireGeometry& g) {
  Measurements result;
  result.geometry = g;
  const int width = g.grid.width, height = g.grid.height;
  const std::size_t texels = g.plane_size();
  const std::vector<double> gu = lightfield::GramMatrix(g.grid.basis, width, g.grid.spacing_m);
  const std::vector<double> gv = lightfield::GramMatrix(g.grid.basis, height, g.grid.spacing_m);
  for (int m = 0; m < g.grid.count(); ++m) {
    Measurement position;
    for (int channel = 0; channel < g.channels; ++channel)
      for (std::size_t p = 0; p < texels; ++p) {
        double e = 0;
        for (int n = 0; n < g.grid.count(); ++n) {
          const double weight =
              gu[m % width * width + n % width] * gv[m / width * height + n / width];
          if (weight != 0) e += weight * TrueCoefficient(g, n, channel, p);
        }
        position.irradiance.push_back(static_cast<float>(e));
        position.sigma.push_back(static_cast<float>(0.01 * e + 1e-9));
      }
    position.count.assign(texels, 1);
    position.mask.assign(texels, 0);
    result.positions.push_back(std::move(position));
  }
  return result;
}

double RelativeRmse(const Reconstruction& result) {
  const auto& g = result.coefficients.geometry;
  double error = 0, norm = 0;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < g.channels; ++channel)
      for (std::size_t p = 0; p < g.plane_size(); ++p) {
        const double truth = TrueCoefficient(g, m, channel, p);
        const double d = result.coefficients.image(m, channel)[p] - truth;
        error += d * d;
        norm += truth * truth;
      }
  return std::sqrt(error / norm);
}

TEST(Reconstruct, BringsBackALuminaireInTheSpanOfEveryBasis) {
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2}) {
    const Measurements measurements = Measure(Geometry(11, 9, 16, 3, kind));
    EXPECT_LT(RelativeRmse(Reconstruct(measurements)), 2e-6);
    EXPECT_LT(RelativeRmse(Reconstruct(measurements, {Precision::kDouble, false})), 2e-6);
    const Reconstruction non_negative = Reconstruct(measurements, {Precision::kFloat, true});
    EXPECT_LT(RelativeRmse(non_negative), 3e-6);
    EXPECT_GE(*std::min_element(non_negative.coefficients.data.begin(),
                                non_negative.coefficients.data.end()),
              0);
  }
}

TEST(Reconstruct, PropagatesSigmaAsMonteCarloDoes) {
  const LuminaireGeometry g = Geometry(5, 4, 6, 1);
  const Measurements clean = Measure(g);
  const Reconstruction expected = Reconstruct(clean);
  constexpr int kRuns = 600;
  const std::size_t count = expected.coefficients.data.size();
  std::vector<double> sum(count), squares(count);
  for (int run = 0; run < kRuns; ++run) {
    Measurements noisy = clean;
    for (std::size_t m = 0; m < noisy.positions.size(); ++m) {
      core::Random random(kSeed, run, static_cast<std::uint32_t>(m));
      for (std::size_t p = 0; p < g.plane_size(); ++p)
        noisy.positions[m].irradiance[p] +=
            static_cast<float>(random.Normal() * clean.positions[m].sigma[p]);
    }
    const Reconstruction result = Reconstruct(noisy);
    for (std::size_t k = 0; k < count; ++k) {
      const double d = result.coefficients.data[k] - expected.coefficients.data[k];
      sum[k] += d;
      squares[k] += d * d;
    }
  }
  double mean_ratio = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double ratio =
        squares[k] / kRuns / (static_cast<double>(expected.sigma.data[k]) * expected.sigma.data[k]);
    // A sample variance of 600 runs scatters by sqrt(2/600) = 5.8 %; 720 of them stay within 5
    // standard errors.
    EXPECT_NEAR(ratio, 1, 5 * std::sqrt(2.0 / kRuns));
    EXPECT_LT(std::abs(sum[k] / kRuns), 5 * expected.sigma.data[k] / std::sqrt(kRuns));
    mean_ratio += ratio / static_cast<double>(count);
  }
  EXPECT_NEAR(mean_ratio, 1, 0.02);
}

Matrix Rows(const LuminaireGeometry& g, const std::vector<int>& known) {
  const std::vector<double> gu =
      lightfield::GramMatrix(g.grid.basis, g.grid.width, g.grid.spacing_m);
  const std::vector<double> gv =
      lightfield::GramMatrix(g.grid.basis, g.grid.height, g.grid.spacing_m);
  Matrix a(known.size(), g.grid.count());
  for (std::size_t k = 0; k < known.size(); ++k)
    for (int n = 0; n < g.grid.count(); ++n)
      a(k, n) = gu[known[k] % g.grid.width * g.grid.width + n % g.grid.width] *
                gv[known[k] / g.grid.width * g.grid.height + n / g.grid.width];
  return a;
}

// Minimum norm by a complete orthogonal decomposition of the dense rows: another algorithm.
Eigen::VectorXd PseudoInverse(const LuminaireGeometry& g, const std::vector<int>& known,
                              const Eigen::VectorXd& e) {
  return Rows(g, known).completeOrthogonalDecomposition().solve(e);
}

TEST(Reconstruct, TakesTheSmallestCoefficientsWherePositionsAreMissing) {
  const LuminaireGeometry g = Geometry(6, 5, 4, 3);
  Measurements measurements = Measure(g);
  const auto hide = [&](std::size_t p, int m, std::uint32_t flag) {
    auto& position = measurements.positions[m];
    position.mask[p] = flag;
    for (int channel = 0; channel < 3; ++channel)
      position.irradiance[channel * g.plane_size() + p] = 0;  // as stored; must not enter
  };
  for (int m = 0; m < 30; ++m) {
    if (m % 6 < 2 || m / 6 == 4) hide(0, m, lightfield::kOffSensor);  // a product I x J remains
    if (m == 7) hide(1, m, lightfield::kDefect);                      // one gap
    if (m % 6 < 2 || m == 9 || m == 16) hide(2, m, lightfield::kSaturated);  // columns and gaps
    if (m % 6 + m / 6 > 4) hide(3, m, lightfield::kOffSensor);               // a triangle
    hide(4, m, lightfield::kOffSensor);                                      // nothing
    if (m == 3) measurements.positions[m].mask[5] = lightfield::kTooDark;    // known all the same
  }
  const Reconstruction result = Reconstruct(measurements);
  EXPECT_EQ(result.report.incomplete.incomplete, 5u);
  EXPECT_EQ(result.report.incomplete.with_gaps, 3u);
  EXPECT_EQ(result.report.incomplete.unknown, 1u);
  EXPECT_EQ(result.report.too_dark, 1u);
  // Mean square of C over all texels but the one of which nothing is known.
  double prior[3] = {};
  for (int channel = 0; channel < 3; ++channel)
    for (int m = 0; m < 30; ++m)
      for (std::size_t p = 0; p < g.plane_size(); ++p)
        if (p != 4)
          prior[channel] += std::pow(double{result.coefficients.image(m, channel)[p]}, 2) /
                            (30.0 * static_cast<double>(g.plane_size() - 1));
  for (std::size_t p = 0; p < 6; ++p) {
    std::vector<int> known;
    for (int m = 0; m < 30; ++m)
      if (!(measurements.positions[m].mask[p] & lightfield::kUnknownMask)) known.push_back(m);
    EXPECT_EQ(result.unknown_positions[p], 30 - known.size());
    for (int channel = 0; channel < 3; ++channel) {
      Eigen::VectorXd e(known.size()), c = Eigen::VectorXd::Zero(30);
      for (std::size_t k = 0; k < known.size(); ++k)
        e(k) = measurements.positions[known[k]].irradiance[channel * g.plane_size() + p];
      if (!known.empty()) c = PseudoInverse(g, known, e);
      // float32 data; full pixels are solved in float32 with condition number 40.
      for (int m = 0; m < 30; ++m)
        EXPECT_NEAR(result.coefficients.image(m, channel)[p], c(m),
                    1e-5 * c.lpNorm<Eigen::Infinity>())
            << "pixel " << p << ", image " << m;
      // sigma: rows of the dense pseudo-inverse, one unit vector at a time, and of the prior what
      // its projection leaves open. With nothing known that is all of it.
      Eigen::VectorXd variance = Eigen::VectorXd::Zero(30);
      if (known.empty()) {
        variance.setConstant(prior[channel]);
      } else if (known.size() < 30) {
        const Matrix rows = Rows(g, known);
        const Matrix open = Matrix::Identity(30, 30) -
                            Matrix(rows.completeOrthogonalDecomposition().pseudoInverse()) * rows;
        variance = c.squaredNorm() / static_cast<double>(known.size()) * open.diagonal();
      }
      for (std::size_t k = 0; k < known.size(); ++k) {
        const double sigma = measurements.positions[known[k]].sigma[channel * g.plane_size() + p];
        const Eigen::VectorXd column =
            PseudoInverse(g, known, Eigen::VectorXd::Unit(known.size(), k));
        variance += (column * sigma).cwiseAbs2();
      }
      for (int m = 0; m < 30; ++m)
        EXPECT_NEAR(result.sigma.image(m, channel)[p], std::sqrt(variance(m)),
                    1e-5 * std::sqrt(variance.maxCoeff()));
    }
  }
}

TEST(Reconstruct, RefusesByNumberWhatItCannotSolveDensely) {
  // Every texel lacks its own random half of 32 x 32 positions: each would need a dense 1024 x 1024
  // system.
  const LuminaireGeometry g = Geometry(32, 32, 40, 1);
  Measurements measurements;
  measurements.geometry = g;
  for (int m = 0; m < g.grid.count(); ++m) {
    core::Random random(kSeed, 77, static_cast<std::uint32_t>(m));
    Measurement position;
    position.irradiance.assign(g.plane_size(), 1);
    position.sigma.assign(g.plane_size(), 1);
    for (std::size_t p = 0; p < g.plane_size(); ++p)
      position.mask.push_back(random() % 2 ? lightfield::kDefect : 0u);
    measurements.positions.push_back(std::move(position));
  }
  try {
    Reconstruct(measurements);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("1600 pixels"), std::string::npos) << error.what();
  }
}

TEST(Reconstruct, LeavesDualMeasurementsAsTheyAre) {
  const LuminaireGeometry g = Geometry(4, 3, 5, 1, BasisKind::kQuadratic);
  Measurements measurements = Measure(g);
  measurements.filter = FilterKind::kDual;
  measurements.positions[2].mask[7] = lightfield::kOffSensor;
  const Reconstruction result = Reconstruct(measurements);
  EXPECT_FLOAT_EQ(result.coefficients.image(3, 0)[6],
                  measurements.positions[3].irradiance[6] / 1e-4f);
  EXPECT_FLOAT_EQ(result.sigma.image(3, 0)[6], measurements.positions[3].sigma[6] / 1e-4f);
  EXPECT_EQ(result.coefficients.image(2, 0)[7], 0);
  EXPECT_EQ(result.unknown_positions[7], 1);
  EXPECT_EQ(result.report.incomplete.incomplete, 1u);
  EXPECT_EQ(result.report.solve, "none");
  EXPECT_EQ(result.report.condition, 1);
  EXPECT_EQ(result.sigma.provenance.at("solve"), "none");
  // The missing one is 0, give or take the texel's others.
  double squares = 0;
  for (int m = 0; m < 12; ++m) squares += std::pow(double{result.coefficients.image(m, 0)[7]}, 2);
  EXPECT_NEAR(result.sigma.image(2, 0)[7], std::sqrt(squares / 11), 1e-5 * std::sqrt(squares));
}

TEST(Reconstruct, ProjectsDualCoefficientsAsThoseOfASolve) {
  // Noisy E of a lamp with dark filters: the nearest light field in the L2 norm over F with C >= 0
  // and the flux of the texel obeys the Karush-Kuhn-Tucker conditions of the basis' Gram matrix.
  const LuminaireGeometry g = Geometry(5, 4, 8, 1, BasisKind::kQuadratic);
  constexpr int kImages = 20;
  Measurements measurements = Measure(g);
  measurements.filter = FilterKind::kDual;
  core::Random random(kSeed, 9);
  for (Measurement& position : measurements.positions)
    for (float& e : position.irradiance) e = static_cast<float>(random.Normal() + 0.4);
  const Reconstruction plain = Reconstruct(measurements),
                       projected = Reconstruct(measurements, {Precision::kFloat, true});
  ASSERT_TRUE(projected.report.non_negative);
  EXPECT_EQ(projected.report.non_negative->unconverged, 0u);
  EXPECT_GT(plain.report.coefficients.negative_energy, 0.1);
  EXPECT_EQ(projected.report.coefficients.negative_energy,
            plain.report.coefficients.negative_energy);
  const auto gu = lightfield::GramMatrix(g.grid.basis, g.grid.width, g.grid.spacing_m),
             gv = lightfield::GramMatrix(g.grid.basis, g.grid.height, g.grid.spacing_m);
  Matrix gram(kImages, kImages);
  for (int m = 0; m < kImages; ++m)
    for (int n = 0; n < kImages; ++n) gram(m, n) = gu[m % 5 * 5 + n % 5] * gv[m / 5 * 4 + n / 5];
  int projected_texels = 0;
  for (std::size_t p = 0; p < g.plane_size(); ++p) {
    Eigen::VectorXd x(kImages), x0(kImages);
    for (int m = 0; m < kImages; ++m) {
      x(m) = projected.coefficients.image(m, 0)[p];
      x0(m) = plain.coefficients.image(m, 0)[p];
    }
    if (!(x0.sum() > 0)) continue;
    ++projected_texels;
    const double scale = x0.cwiseAbs().maxCoeff();
    EXPECT_GE(x.minCoeff(), 0);
    EXPECT_NEAR(x.sum(), x0.sum(), 1e-5 * x0.cwiseAbs().sum());
    const Eigen::VectorXd gradient = gram * (x - x0) / gram.diagonal().maxCoeff();
    const double multiplier = gradient.dot(x) / x.sum();
    for (int m = 0; m < kImages; ++m) {
      EXPECT_GE(gradient(m) - multiplier, -1e-4 * scale);
      if (x(m) > 1e-3 * scale) {
        EXPECT_NEAR(gradient(m), multiplier, 1e-4 * scale);
      }
    }
  }
  EXPECT_GT(projected_texels, 50);
}

TEST(Reconstruct, RefusesMeasurementsThatDoNotFitTheirGeometry) {
  Measurements measurements = Measure(Geometry(3, 3, 4, 1));
  Measurements few = measurements;
  few.positions.pop_back();
  EXPECT_THROW(Reconstruct(few), InputError);
  Measurements small = measurements;
  small.positions[4].sigma.pop_back();
  EXPECT_THROW(Reconstruct(small), InputError);
}

TEST(Reconstruct, ReportsWhatItKnows) {
  Measurements measurements = Measure(Geometry(11, 9, 4, 1));
  for (float& x : measurements.positions[50].irradiance)
    x *= 0.5f;  // makes neighbours ring below zero
  const Reconstruction result = Reconstruct(measurements, {Precision::kFloat, true});
  double positive = 0, negative = 0;
  const Reconstruction plain = Reconstruct(measurements);
  for (const float c : plain.coefficients.data) (c < 0 ? negative : positive) += std::abs(c);
  const nlohmann::json json = ToJson(result.report);
  EXPECT_NEAR(json["negative_energy"].get<double>(), negative / positive, 1e-12);
  EXPECT_GT(json["negative_energy"].get<double>(), 0.001);
  EXPECT_NEAR(json["noise_gain"].get<double>(), 10.7, 0.05);
  EXPECT_EQ(json["images"], 99);
  EXPECT_GT(json["non_negative"]["pixels"].get<int>(), 0);
  EXPECT_EQ(json["non_negative"]["unconverged"], 0);
  for (const auto* field : {&result.coefficients, &result.sigma}) {
    EXPECT_EQ(field->provenance.at("solve"), "gram");
    EXPECT_EQ(field->provenance.at("kept_moments"),
              std::to_string(result.report.kept.u) + " " + std::to_string(result.report.kept.v));
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
