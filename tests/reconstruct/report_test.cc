#include "luxfield/reconstruct/solve/report.h"
#include "luxfield/reconstruct/solve/report_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::LightField;

LightField Field(const std::vector<float>& values) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.1;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBox), 2,
                                          1, 0.01);
  g.lattice = {3, 1, -0.1, 0.1, 0.01, 0.01};
  LightField field(g);
  EXPECT_EQ(field.data.size(), values.size());
  field.data = values;
  return field;
}

// By hand, of 2 images of 3 texels.
TEST(CoefficientStatistics, AreThoseOfTheirNames) {
  const LightField c = Field({3, -1, 0, 5, -0.5f, 0.5f});
  const LightField sigma = Field({0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f});
  const CoefficientStatistics s = Statistics(c, sigma);
  EXPECT_EQ(s.min, -1);
  EXPECT_EQ(s.max, 5);
  EXPECT_NEAR(s.mean, 7.0 / 6, 1e-12);
  EXPECT_NEAR(s.negative_energy, 1.5 / 8.5, 1e-12);
  // Root of the sums of sigma^2 and C^2; float32 values.
  EXPECT_NEAR(s.sigma_relative, std::sqrt(0.91 / 35.5), 1e-7);
  EXPECT_EQ(s.sigma_median, 0.4f);
}

TEST(CoefficientStatistics, OfNothingAndOfDarknessAreNoNaN) {
  const CoefficientStatistics dark =
      Statistics(Field(std::vector<float>(6)), Field(std::vector<float>(6, 1)));
  EXPECT_EQ(dark.sigma_relative, 0);
  EXPECT_EQ(dark.negative_energy, 0);
  EXPECT_EQ(dark.mean, 0);
  EXPECT_EQ(dark.sigma_median, 1);
}

// Sums over vectors of values and over what is left at the end.
TEST(CoefficientStatistics, SumManyValues) {
  core::Random random(3, 1);
  LightField c, sigma;
  double positive = 0, negative = 0, squares = 0, variances = 0;
  for (int k = 0; k < 1003; ++k) {
    c.data.push_back(static_cast<float>(random.Normal()));
    sigma.data.push_back(random.UniformFloat());
    (c.data[k] < 0 ? negative : positive) += std::abs(double{c.data[k]});
    squares += double{c.data[k]} * c.data[k];
    variances += double{sigma.data[k]} * sigma.data[k];
  }
  const CoefficientStatistics s = Statistics(c, sigma);
  EXPECT_NEAR(s.mean, (positive - negative) / 1003, 1e-12);
  EXPECT_NEAR(s.negative_energy, negative / positive, 1e-12);
  EXPECT_NEAR(s.sigma_relative, std::sqrt(variances / squares), 1e-12);
  for (const int k : {4, 1001}) {
    LightField one = c;
    one.data[k] = 100;
    EXPECT_EQ(Statistics(one, sigma).max, 100);
    one.data[k] = -100;
    EXPECT_EQ(Statistics(one, sigma).min, -100);
  }
}

TEST(CoefficientStatistics, ThePlaceOfAValueIsThatOfTheSortedValues) {
  core::Random random(2, 1);
  std::vector<float> values;
  for (int k = 0; k < 300; ++k)
    values.push_back(static_cast<float>(random.Normal() * std::exp(8 * random.Normal())));
  for (const float value : {1.0f, 1.0f, std::nextafter(1.0f, 2.0f), 0.0f, -2.5f, INFINITY, 1e-40f})
    values.push_back(value);
  std::vector<float> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t n = 0; n < values.size(); ++n) EXPECT_EQ(NthSmallest(values, n), sorted[n]) << n;
}

TEST(ReconstructionReport, SaysWhatWasNotAskedForByLeavingItOut) {
  ReconstructionReport report;
  EXPECT_FALSE(ToJson(report).contains("moment_residual"));
  EXPECT_FALSE(ToJson(report).contains("filter_noise"));
  report.moment_residual = 0.25;
  report.filter_noise = 0.5;
  EXPECT_EQ(ToJson(report).at("moment_residual"), 0.25);
  EXPECT_EQ(ToJson(report).at("filter_noise"), 0.5);
}

}  // namespace
}  // namespace luxfield::reconstruct
