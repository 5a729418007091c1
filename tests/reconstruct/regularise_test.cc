#include "luxfield/reconstruct/solve/regularise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <iostream>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/reconstruct/merge/filter_profile.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::Basis;
using lightfield::BasisGrid;
using lightfield::BasisKind;
using lightfield::FilterKind;
using lightfield::Measurement;
using lightfield::Measurements;
using lightfield::Vec2;
using testing::HasSubstr;

constexpr std::uint64_t kSeed = 5077;
constexpr int kWidth = 7, kHeight = 6, kSize = 20;
constexpr std::size_t kTexels = kSize * kSize;
constexpr double kSpacing_m = 0.0165;

using Lamp = std::function<double(int i, int j, std::size_t texel)>;

// Smooth over the filters, but for a window frame that no smoothness allows for.
double Headlight(int i, int j, std::size_t texel) {
  const double x = static_cast<double>(texel % kSize) / kSize,
               y = static_cast<double>(texel / kSize) / kSize;
  const double smooth = std::exp(-0.5 * (std::pow(i - 2 - 2 * x, 2) + std::pow(j - 3 + y, 2)) / 4);
  return 1e4 * (smooth + (i == 4 ? 0.15 : 0));
}

std::vector<double> Values(const Lamp& lamp) {
  std::vector<double> values;
  for (int j = 0; j < kHeight; ++j)
    for (int i = 0; i < kWidth; ++i)
      for (std::size_t p = 0; p < kTexels; ++p) values.push_back(lamp(i, j, p));
  return values;
}

double Rms(const std::vector<double>& values) {
  double square = 0;
  for (const double x : values) square += x * x;
  return std::sqrt(square / static_cast<double>(values.size()));
}

// E through filters displaced by `off`, by the closed form of the 1-D functions' overlap; noise
// relative to the largest E, more where there is more light.
Measurements Measure(const Lamp& lamp, double noise, std::uint64_t run, Vec2 off = {},
                     FilterKind filter = FilterKind::kBasis) {
  Measurements result;
  result.filter = filter;
  auto& g = result.geometry;
  g.delta_m = 0.3;
  g.grid = BasisGrid::Centred(
      Basis::Make(filter == FilterKind::kDual ? BasisKind::kQuadratic : BasisKind::kBspline2),
      kWidth, kHeight, kSpacing_m);
  const FilterProfile profile(filter, g.grid.basis);
  g.lattice = {kSize, kSize, -0.1, 0.1, 0.2 / kSize, 0.2 / kSize};
  double largest = 0;
  for (int j = 0; j < kHeight; ++j)
    for (int i = 0; i < kWidth; ++i) {
      Measurement& position = result.positions.emplace_back();
      // Every second filter stands beside its place.
      position.displacement_m = (i + j) % 2 ? off : Vec2{};
      const double du = position.displacement_m.x / kSpacing_m,
                   dv = position.displacement_m.y / kSpacing_m;
      std::vector<double> u, v;
      for (int m = 0; m < kWidth; ++m) u.push_back(profile.Overlap(m - i - du));
      for (int n = 0; n < kHeight; ++n) v.push_back(profile.Overlap(n - j - dv));
      for (std::size_t p = 0; p < kTexels; ++p) {
        double e = 0;
        for (int n = 0; n < kHeight; ++n)
          for (int m = 0; m < kWidth; ++m) e += u[m] * v[n] * lamp(m, n, p);
        position.irradiance.push_back(static_cast<float>(kSpacing_m * kSpacing_m * e));
        largest = std::max<double>(largest, position.irradiance.back());
      }
      position.count.assign(kTexels, 1);
      position.mask.assign(kTexels, 0);
    }
  for (std::size_t m = 0; m < result.positions.size(); ++m) {
    core::Random random(kSeed, run, static_cast<std::uint32_t>(m));
    Measurement& position = result.positions[m];
    for (float& e : position.irradiance) {
      const double sigma = noise * largest * std::sqrt(0.1 + e / largest);
      position.sigma.push_back(static_cast<float>(sigma));
      e += static_cast<float>(sigma * random.Normal());
    }
  }
  return result;
}

Reconstruction Solve(const Measurements& measurements, std::optional<double> lambda) {
  ReconstructOptions options;
  options.regularise = true;
  options.lambda = lambda;
  return Reconstruct(measurements, options);
}

std::vector<double> Difference(const Reconstruction& a, const std::vector<double>& b) {
  std::vector<double> difference;
  for (std::size_t k = 0; k < b.size(); ++k) difference.push_back(a.coefficients.data[k] - b[k]);
  return difference;
}

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x;
  return sum;
}

constexpr double kNoise = 0.01, kNoNoise = 1e-9;

// What the summaries of noisy runs state against the bias that a run without noise has: z-tests,
// as the estimates of the squares are unbiased.
void StatesItsBias(double lambda, Vec2 displacement, FilterKind filter = FilterKind::kBasis) {
  constexpr int kRuns = 12;
  const std::vector<double> truth = Values(Headlight);
  const auto off =
      Difference(Solve(Measure(Headlight, kNoNoise, 0, displacement, filter), lambda), truth);
  const double bias = Rms(off) / Rms(truth), flux_bias = Sum(off) / Sum(truth);
  const auto judge = [&](const char* what, const std::vector<double>& stated, double measured) {
    const double mean = Sum(stated) / kRuns;
    double square = 0;
    for (const double x : stated) square += (x - mean) * (x - mean);
    const double z = (mean - measured) / std::sqrt(square / (kRuns * (kRuns - 1.0)));
    std::cout << "lambda " << lambda << ": " << what << " stated " << mean << ", measured "
              << measured << ", z " << z << '\n';
    EXPECT_LT(std::abs(z), 5);  // Student's t of 11 degrees: 4e-4 a side
    EXPECT_NEAR(mean / measured, 1, 0.1);
  };
  std::vector<double> squares, fluxes;
  for (int run = 1; run <= kRuns; ++run) {
    const auto summary =
        *Solve(Measure(Headlight, kNoise, run, displacement, filter), lambda).report.regularisation;
    EXPECT_EQ(summary.lambda, lambda);
    EXPECT_LE(summary.bias, summary.worst_bias);
    squares.push_back(summary.bias * summary.bias);
    fluxes.push_back(summary.flux_bias);
  }
  judge("bias^2", squares, bias * bias);
  judge("bias of the flux", fluxes, flux_bias);
}

TEST(Regularise, StatesItsBias) {
  std::cout << "seed " << kSeed << '\n';
  StatesItsBias(0.3, {});
}

TEST(Regularise, StatesItsBiasBehindDisplacedFilters) {
  StatesItsBias(0.3, {0.04 * kSpacing_m, -0.03 * kSpacing_m});
}

TEST(Regularise, StatesItsBiasBehindDualFilters) {
  StatesItsBias(0.3, {0.04 * kSpacing_m, -0.03 * kSpacing_m}, FilterKind::kDual);
}

TEST(Regularise, NoiseFallsAsPredicted) {
  const std::vector<double> truth = Values(Headlight);
  const Measurements noisy = Measure(Headlight, kNoise, 1);
  double before = 1;
  for (const double lambda : {1e-6, 0.05, 0.3, 1.0}) {
    const Reconstruction result = Solve(noisy, lambda),
                         quiet = Solve(Measure(Headlight, kNoNoise, 1), lambda);
    const std::vector<double> expected(quiet.coefficients.data.begin(),
                                       quiet.coefficients.data.end());
    std::vector<double> noise = Difference(result, expected), by_sigma = noise;
    for (std::size_t k = 0; k < noise.size(); ++k) by_sigma[k] /= result.sigma.data[k];
    const auto& summary = *result.report.regularisation;
    // 400 texels of at least 6 modes each: 5 standard errors are 7 %.
    EXPECT_NEAR(Rms(noise) / Rms(truth) / summary.noise, 1, 0.07) << lambda;
    EXPECT_NEAR(Rms(by_sigma), 1, 0.07) << lambda;
    EXPECT_LT(summary.noise, before);
    before = summary.noise;
    std::cout << "lambda " << lambda << ": noise " << summary.noise << " of "
              << summary.noise_before << ", gain " << summary.noise_gain << " of "
              << result.report.noise_gain << ", bias " << summary.bias << '\n';
  }
  // Hardly any lambda: the plain solve.
  const auto summary = *Solve(noisy, 1e-6).report.regularisation;
  EXPECT_NEAR(summary.noise / summary.noise_before, 1, 1e-6);
  EXPECT_NEAR(summary.noise_gain / Reconstruct(noisy).report.noise_gain, 1, 1e-6);
}

TEST(Regularise, ChoosesTheLambdaOfLeastError) {
  const std::vector<double> truth = Values(Headlight);
  for (const double noise : {0.001, 0.01, 0.1}) {
    const Measurements noisy = Measure(Headlight, noise, 7);
    const Reconstruction chosen = Solve(noisy, {});
    EXPECT_TRUE(chosen.report.regularisation->chosen);
    const double plain = Rms(Difference(Reconstruct(noisy), truth));
    double least = plain;
    for (double lambda = 1e-3; lambda < 100; lambda *= 1.5)
      least = std::min(least, Rms(Difference(Solve(noisy, lambda), truth)));
    const double error = Rms(Difference(chosen, truth));
    std::cout << "noise " << noise << ": lambda " << chosen.report.regularisation->lambda
              << ", error " << error / Rms(truth) << ", least " << least / Rms(truth)
              << ", without " << plain / Rms(truth) << '\n';
    EXPECT_LT(error, 1.03 * least);
  }
}

// Against the normal equations of its definition, with D and A written out function by function:
//   (A^T A + lambda^2 D^T D) C = A^T E / h^2
TEST(Regularise, IsTheLeastOfWhatItMinimises) {
  constexpr double kLambda = 0.5;
  constexpr int kCount = kWidth * kHeight;
  const Measurements noisy = Measure(Headlight, kNoise, 4);
  const Reconstruction result = Solve(noisy, kLambda);
  const FilterProfile profile(FilterKind::kBasis, noisy.geometry.grid.basis);
  Eigen::MatrixXd a(kCount, kCount), d = Eigen::MatrixXd::Zero(2 * kCount, kCount);
  for (int r = 0; r < kCount; ++r)
    for (int m = 0; m < kCount; ++m)
      a(r, m) = profile.Overlap(m % kWidth - r % kWidth) * profile.Overlap(m / kWidth - r / kWidth);
  for (int m = 0; m < kCount; ++m) {
    if (m % kWidth + 1 < kWidth) d(2 * m, m) = -1, d(2 * m, m + 1) = 1;
    if (m / kWidth + 1 < kHeight) d(2 * m + 1, m) = -1, d(2 * m + 1, m + kWidth) = 1;
  }
  const Eigen::LDLT<Eigen::MatrixXd> normal(a.transpose() * a +
                                            kLambda * kLambda * d.transpose() * d);
  for (const std::size_t p : {std::size_t{0}, std::size_t{137}, kTexels - 1}) {
    Eigen::VectorXd e(kCount);
    for (int m = 0; m < kCount; ++m)
      e(m) = noisy.positions[m].irradiance[p] / (kSpacing_m * kSpacing_m);
    const Eigen::VectorXd c = normal.solve(a.transpose() * e);
    for (int m = 0; m < kCount; ++m)
      EXPECT_NEAR(result.coefficients.image(m, 0)[p], c(m), 1e-5 * c.cwiseAbs().maxCoeff())
          << "texel " << p << ", function " << m;
  }
}

TEST(Regularise, LeavesLampsAloneThatAreEvenOverTheFilters) {
  const Lamp even = [](int, int, std::size_t texel) { return 100.0 + static_cast<double>(texel); };
  const std::vector<double> truth = Values(even);
  const Reconstruction result = Solve(Measure(even, kNoNoise, 1), 100);
  EXPECT_LT(Rms(Difference(result, truth)) / Rms(truth), 1e-6);  // of float32
  EXPECT_NEAR(result.report.regularisation->flux_bias, 0, 1e-6);
}

TEST(Regularise, LeavesTexelsWithMissingPositionsAsTheyWere) {
  Measurements measurements = Measure(Headlight, kNoise, 3);
  measurements.positions[5].mask[17] = lightfield::kOffSensor;
  measurements.positions[5].irradiance[17] = measurements.positions[5].sigma[17] = 0;
  const Reconstruction plain = Reconstruct(measurements), result = Solve(measurements, 0.5);
  EXPECT_EQ(result.report.regularisation->texels, kTexels - 1);
  for (int m = 0; m < kWidth * kHeight; ++m) {
    const float a = result.coefficients.image(m, 0)[17], b = plain.coefficients.image(m, 0)[17];
    EXPECT_NEAR(a, b, 1e-4 * 1e4);  // general and separable solve, float E
    EXPECT_NE(result.coefficients.image(m, 0)[18], plain.coefficients.image(m, 0)[18]);
  }
}

TEST(Regularise, RefusesNonsense) {
  const auto refuses = [](const char* what, const std::function<void()>& act) {
    try {
      act();
      ADD_FAILURE() << what;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  };
  const Measurements noisy = Measure(Headlight, kNoise, 1);
  for (const double lambda : {0.0, -1.0, double(NAN), double(INFINITY)})
    refuses("lambda must be above 0", [&] { Solve(noisy, lambda); });
  refuses("cannot be stated", [&] {
    ReconstructOptions options;
    options.regularise = options.non_negative = true;
    Reconstruct(noisy, options);
  });
  refuses("several measurements", [&] {
    ReconstructOptions options;
    options.regularise = true;
    Reconstruct(std::vector{noisy, noisy}, options);
  });
  Measurements other = noisy;
  for (auto& position : other.positions) position.mask.assign(kTexels, lightfield::kSaturated);
  refuses("no texel knows all positions", [&] { Solve(other, 1); });
  other = Measure([](int, int, std::size_t) { return 0.0; }, 0, 1);
  refuses("above its noise", [&] { Solve(other, 1); });
}

}  // namespace
}  // namespace luxfield::reconstruct
