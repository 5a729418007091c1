// Response curves against cameras whose curve is known, and against another program's solution.
#include "luxfield/reconstruct/calibrate/response/fit_response.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <map>

#include "frobisher.h"
#include "test_camera.h"

namespace luxfield::reconstruct {
namespace {

const std::vector<double> kExposures = {0.01, 0.03, 0.1, 0.25, 1, 3.5};

FittedResponse Fit(const TestCamera& camera, ResponseMethod method) {
  constexpr int kWidth = 240, kHeight = 120;
  const auto scene = TestScene(kWidth, kHeight, 2e-3, 4.5);
  const PictureStack stack = TakeStack(camera, scene, kWidth, kExposures);
  const auto samples = FlatSamples(stack, 0, camera.full_code(), 1000);
  FitResponseOptions options;
  options.method = method;
  return FitResponse(samples, kExposures, camera.full_code(), std::ceil(camera.full_code() / 2),
                     options, "test");
}

struct Pooled {
  double chi_squared = 0;   // per code
  double largest_bias = 0;  // of a code's mean error, in its standard errors
  double rms_error = 0;
};

// Errors of ln I over cameras of different seeds, against their stated sigma.
Pooled Pool(const std::function<TestCamera(std::uint64_t)>& camera_of, ResponseMethod method,
            int seeds) {
  std::map<double, std::vector<double>> errors;
  std::map<double, double> variance;
  Pooled pooled;
  double count = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const TestCamera camera = camera_of(seed);
    const FittedResponse fit = Fit(camera, method);
    const ResponseCurve& curve = fit.curve;
    EXPECT_NEAR(fit.chi_squared / fit.degrees, 1, 0.1) << "seed " << seed;
    EXPECT_LT(curve.low_code(), 0.12 * camera.full_code()) << "seed " << seed;
    EXPECT_GT(curve.high_code(), 0.85 * camera.full_code()) << "seed " << seed;
    for (std::size_t k = 0; k < curve.code.size(); ++k) {
      if (curve.code[k] == curve.reference_code) continue;
      const double error =
          curve.log_exposure[k] - camera.LogExposure(curve.code[k], curve.reference_code);
      errors[curve.code[k]].push_back(error);
      variance[curve.code[k]] += curve.sigma[k] * curve.sigma[k];
      pooled.chi_squared += error * error / (curve.sigma[k] * curve.sigma[k]);
      pooled.rms_error += error * error;
      ++count;
    }
  }
  pooled.chi_squared /= count;
  pooled.rms_error = std::sqrt(pooled.rms_error / count);
  for (const auto& [code, values] : errors) {
    if (static_cast<int>(values.size()) < seeds) continue;
    double sum = 0;
    for (const double value : values) sum += value;
    pooled.largest_bias = std::max(pooled.largest_bias, std::abs(sum) / std::sqrt(variance[code]));
  }
  std::cout << fmt::format(
      "chi^2 of the curve's errors {:.3f} a code, largest bias {:.2f} standard errors, rms error "
      "{:.5f} (seeds 1 to {})\n",
      pooled.chi_squared, pooled.largest_bias, pooled.rms_error, seeds);
  return pooled;
}

// A curve of the smooth families has some ten independent errors, hence the bounds: 4 standard
// deviations of chi-squared of 10 degrees a seed, and of the largest of ten normal numbers.
void ExpectErrorsFollowSigma(const Pooled& pooled, int degrees) {
  EXPECT_NEAR(pooled.chi_squared, 1, 4 * std::sqrt(2.0 / degrees));
  EXPECT_LT(pooled.largest_bias, 4);
}

TEST(FitResponse, ErrorsOfTheSmoothCurveFollowItsSigma) {
  constexpr int kSeeds = 8;
  ExpectErrorsFollowSigma(Pool(CurvedCamera, ResponseMethod::kDebevecMalik, kSeeds), 10 * kSeeds);
}

TEST(FitResponse, ErrorsOfTheRobertsonCurveFollowItsSigma) {
  constexpr int kSeeds = 5;
  ExpectErrorsFollowSigma(Pool(CurvedCamera, ResponseMethod::kRobertson, kSeeds), 10 * kSeeds);
}

// I = (v + 2 v^3) / 3.
TestCamera PolynomialCamera(std::uint64_t seed) {
  TestCamera camera;
  camera.seed = seed;
  camera.expose = [](double v) { return (v + 2 * v * v * v) / 3; };
  camera.develop = [expose = camera.expose](double x) {
    double low = 0, high = 1;
    for (int step = 0; step < 40; ++step) {
      const double middle = (low + high) / 2;
      (expose(middle) < x ? low : high) = middle;
    }
    return (low + high) / 2;
  };
  return camera;
}

TEST(FitResponse, FindsThePolynomialOfACameraThatIsOne) {
  constexpr int kSeeds = 6;
  // Three coefficients a seed.
  ExpectErrorsFollowSigma(Pool(PolynomialCamera, ResponseMethod::kPolynomial, kSeeds), 3 * kSeeds);
  EXPECT_EQ(Fit(PolynomialCamera(1), ResponseMethod::kPolynomial).order, 3);
}

TEST(FitResponse, SixteenBitLinearCamera) {
  const auto linear = [](std::uint64_t seed) {
    TestCamera camera;
    camera.seed = seed;
    camera.bits = 16;
    camera.develop = camera.expose = [](double x) { return x; };
    return camera;
  };
  constexpr int kSeeds = 4;
  const Pooled pooled = Pool(linear, ResponseMethod::kDebevecMalik, kSeeds);
  // A line in ln z is nearly one in LogitCode: the errors lie below a sigma that knows of curves.
  EXPECT_LT(pooled.chi_squared, 1 + 4 * std::sqrt(2.0 / (10 * kSeeds)));
  EXPECT_LT(pooled.largest_bias, 4);
}

// The published problem's solution by colour-hdri, on a Canon 5D Mark II's JPEGs. All exposures are
// a factor 8 apart: what two curves may disagree about is a ripple of period ln 8, which smoothness
// alone decides. What the pictures show, the step of g from a code to the one 8 times brighter,
// they have to agree about.
TEST(FitResponse, AgreesWithTheForeignCurvesOfTheFrobisherStack) {
  LUXFIELD_NEEDS_DATA(FrobisherFile(""));
  const PictureStack stack = FrobisherStack();
  const std::vector<double> exposures = {0.125, 1, 8};
  for (int channel = 0; channel < 3; ++channel) {
    const auto expected = FrobisherCurve(channel);
    const FittedResponse fit =
        FitResponse(FlatSamples(stack, channel, 255, 2000), exposures, 255, 128, {}, "Frobisher");
    const ResponseCurve& curve = fit.curve;
    double squares = 0, in_sigma = 0, count = 0, steps = 0, step_count = 0;
    for (std::size_t k = 0; k < curve.code.size(); ++k) {
      const double z = curve.code[k];
      if (z == curve.reference_code || z < 10) continue;
      const double difference = curve.log_exposure[k] - expected[static_cast<std::size_t>(z)];
      squares += difference * difference;
      in_sigma += std::pow(difference / curve.sigma[k], 2);
      ++count;
      const double brighter = std::round(curve.Code(curve.log_exposure[k] + std::log(8)));
      if (brighter > curve.high_code()) continue;
      const double step = curve.LogExposure(brighter) - curve.log_exposure[k] -
                          expected[static_cast<std::size_t>(brighter)] +
                          expected[static_cast<std::size_t>(z)];
      steps += step * step;
      ++step_count;
    }
    std::cout << fmt::format(
        "channel {}: codes {} to {}, difference of g {:.4f} rms, {:.2f} of its sigma; of steps by "
        "a factor 8 {:.4f} rms; chi^2 {:.0f} of {:.0f}\n",
        channel, curve.low_code(), curve.high_code(), std::sqrt(squares / count),
        std::sqrt(in_sigma / count), std::sqrt(steps / step_count), fit.chi_squared, fit.degrees);
    EXPECT_LT(std::sqrt(squares / count), 0.06);
    EXPECT_LT(std::sqrt(in_sigma / count), 3);
    EXPECT_LT(std::sqrt(steps / step_count), 0.03);
  }
}

TEST(FitResponse, RefusesWhatSettlesNoCurve) {
  const std::vector<double> times = {1, 2};
  // Codes that fall with exposure.
  ResponseSamples falling{2, {}, {}};
  for (int n = 0; n < 200; ++n)
    for (const int code : {230 - n, 200 - n}) {
      falling.code.push_back(static_cast<std::uint16_t>(code));
      falling.usable.push_back(1);
    }
  ResponseSamples black = falling;
  black.usable.assign(black.code.size(), 0);
  for (const ResponseMethod method :
       {ResponseMethod::kDebevecMalik, ResponseMethod::kRobertson, ResponseMethod::kPolynomial}) {
    FitResponseOptions options;
    options.method = method;
    EXPECT_THROW(FitResponse(black, times, 255, 128, options, "test"), InputError);
    EXPECT_THROW(FitResponse(falling, times, 255, 128, options, "test"), InputError);
    try {
      FitResponse(falling, std::vector<double>{0, 2}, 255, 128, options, "test");
      ADD_FAILURE() << "an exposure of 0 s was fitted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("no solution"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
