#include "luxfield/render/accuracy/light_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace luxfield::render {
namespace {

// v(n) = a / n at s seconds a sample.
LightLaw Independent(double a, double sample_s, double fixed_s = 0) {
  LightLaw light;
  light.variance.Add(1, a);
  light.fixed_s = fixed_s;
  light.sample_s = sample_s;
  return light;
}

// n_l = sqrt(a_l / s_l) / V sum sqrt(a s), so that sum n s = (sum sqrt(a s))^2 / V.
TEST(LightSamples, OfIndependentSamplesAreInClosedForm) {
  const std::vector<LightLaw> lights = {Independent(4, 1e-3, 0.5), Independent(0.01, 4e-3),
                                        Independent(100, 1e-5, 2)};
  const double variance = 0.004;
  double roots = 0;
  for (const LightLaw& light : lights) roots += std::sqrt(light.variance.Of(1) * light.sample_s);
  const std::vector<double> samples = SamplesForVariance(lights, variance);
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const double expected =
        std::sqrt(lights[l].variance.Of(1) / lights[l].sample_s) * roots / variance;
    EXPECT_NEAR(samples[l], expected, 0.03 * expected + 1) << l;
    EXPECT_EQ(samples[l], std::floor(samples[l]));
  }
  EXPECT_LE(VarianceOf(lights, samples), variance);
  const double seconds = 2.5 + roots * roots / variance;
  EXPECT_NEAR(SecondsOf(lights, samples), seconds, 0.03 * seconds);

  // The other way round.
  const std::vector<double> in_time = SamplesForSeconds(lights, seconds);
  EXPECT_LE(SecondsOf(lights, in_time), seconds);
  EXPECT_NEAR(VarianceOf(lights, in_time), variance, 0.05 * variance);
}

// Stratified samples, v = a / n^2: of two such lights n_l ~ (a_l / s_l)^(1/3).
TEST(LightSamples, OfStratifiedSamplesFollowTheirLaw) {
  std::vector<LightLaw> lights(2);
  for (int l = 0; l < 2; ++l) {
    const double a = l == 0 ? 1 : 64;
    lights[l].variance.Add(8, a / 64);
    lights[l].variance.Add(32, a / 1024);
    lights[l].sample_s = 1e-3;
  }
  const std::vector<double> samples = SamplesForVariance(lights, 1e-6);
  EXPECT_NEAR(samples[1] / samples[0], 4, 0.15);
  EXPECT_NEAR(VarianceOf(lights, samples), 1e-6, 5e-8);
}

TEST(LightSamples, AtTheEndsOfWhatCanBeTaken) {
  std::vector<LightLaw> lights = {Independent(1, 1e-6), LightLaw{}, Independent(1, 0)};
  lights[1].sample_s = 1;  // without noise, dear
  lights[2].least = 8;
  std::vector<double> samples = SamplesForVariance(lights, 0.5);
  EXPECT_EQ(samples[1], 2);
  EXPECT_GE(samples[2], 8);
  EXPECT_LE(VarianceOf(lights, samples), 0.5);
  // Out of reach: as many as can be taken.
  EXPECT_EQ(SamplesForVariance(lights, 1e-12), (std::vector<double>{1 << 20, 2, 1 << 20}));
  // No time at all: as few as can be taken.
  EXPECT_EQ(SamplesForSeconds(lights, 0), (std::vector<double>{2, 2, 8}));
  EXPECT_TRUE(SamplesForVariance({}, 1).empty());
}

// A pixel's surface points share its samples: v(n) = v(n / points) / points.
TEST(LightSamples, AreSharedByThePointsOfAPixel) {
  LightLaw light;
  light.variance.Add(8, 1.0 / 64);
  light.variance.Add(32, 1.0 / 1024);
  light.points = 4;
  EXPECT_NEAR(light.Variance(64), 1.0 / 256 / 4, 1e-12);
}

}  // namespace
}  // namespace luxfield::render
