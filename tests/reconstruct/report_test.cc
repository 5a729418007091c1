#include "luxfield/reconstruct/solve/report.h"
#include "luxfield/reconstruct/solve/report_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

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
