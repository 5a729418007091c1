// Probabilities of meeting limits against closed forms of the normal distribution.
#include "luxfield/photometry/conformity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

TEST(PassProbability, IsThatOfTheNormalDistribution) {
  EXPECT_EQ(PassProbability(0, 2), 0.5);
  EXPECT_NEAR(PassProbability(2, 2), 0.841344746, 1e-9);
  EXPECT_NEAR(PassProbability(-3.919928, 2), 0.025, 1e-7);
  EXPECT_EQ(PassProbability(0, 0), 1);
  EXPECT_EQ(PassProbability(-1, 0), 0);
}

// covariance: [k][k], row-major.
double Joint(const std::vector<double>& margins, const std::vector<double>& covariance) {
  return JointPassProbability(
      margins, [&](std::size_t a, std::size_t b) { return covariance[a * margins.size() + b]; });
}

// Two margins of 0: 1/4 + asin(rho) / (2 pi) (Sheppard 1899). Draws scatter by 0.0025.
TEST(JointPassProbability, OfTwoIsSheppards) {
  for (const double rho : {-0.9, 0.0, 0.6, 1.0})
    EXPECT_NEAR(Joint({0, 0}, {4, 6 * rho, 6 * rho, 9}),
                0.25 + std::asin(rho) / (2 * std::numbers::pi), 4.5 * 0.0025)
        << rho;
  EXPECT_NEAR(Joint({0, 1, -1}, {1, 0, 0, 0, 1, 0, 0, 0, 1}), 0.5 * 0.8413447 * 0.1586553,
              4.5 * 0.0013);
}

TEST(JointPassProbability, WhatIsCertainIsLeftOut) {
  EXPECT_EQ(Joint({0, 100}, {1, 0, 0, 1}), 0.5);
  EXPECT_EQ(Joint({0, -100}, {1, 0, 0, 1}), 0);
  EXPECT_EQ(Joint({5, 100}, {0, 0, 0, 0}), 1);
  EXPECT_EQ(Joint({-5, 100}, {0, 0, 0, 0}), 0);
  EXPECT_EQ(Joint({}, {}), 1);
}

// Of two functionals a and b: 2 cov = var(a + b) - var(a) - var(b).
TEST(Covariances, AreThoseOfSums) {
  const auto field = SmoothField();
  for (const SolveMaps& maps : {PlainMaps(field.geometry.grid), SolveMaps{}}) {
    const NoisyField noisy(field, maps, 0.01);
    Lamp lamp = LampOfField(field);
    const std::vector<lightfield::PosedLightField> sigma = {{"", {}, noisy.SigmaOfC()}};
    const std::vector<SolveMaps> all = {maps};
    SetNoise(lamp, sigma, all, "sigma");
    const std::vector<Functional> of = {FluxOf(lamp), IntensityTowards(lamp, {0.1, -0.05, 1}),
                                        IlluminanceAt(lamp, {0.05, 0.02, 0.4}, {0, 0, -1}),
                                        IntensityTowards(lamp, {-5, 0, 1})};
    Covariances covariances(lamp);
    for (const Functional& one : of) covariances.Add(one);
    const auto variance = [&](const Functional& f) {
      const double u = Uncertainty(lamp, f).value();
      return u * u;
    };
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const double expected =
            0.5 * (variance(Sum({{1, &of[a]}, {1, &of[b]}})) - variance(of[a]) - variance(of[b]));
        EXPECT_NEAR(covariances.Of(a, b), expected,
                    1e-9 * std::sqrt(variance(of[a]) * variance(of[b])) + 1e-300)
            << a << b;
      }
  }
}

}  // namespace
}  // namespace luxfield::photometry
