#include "luxfield/reconstruct/calibrate/response/response_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace luxfield::reconstruct {
namespace {

// 40 residuals at a dark code and 40 at a bright one, just as many as a part needs. Their size is
// one number throughout, which clipping at 3 standard deviations leaves as it is: the variance is
// the square over 0.99501, the share of a normal variance that clipping keeps.
TEST(ExposureNoise, PartsOfFortyResidualsStandAlone) {
  std::vector<ExposureResidual> residuals;
  for (int k = 0; k < 40; ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    residuals.push_back({20, 0.2 * sign, 0});
    residuals.push_back({230, 0.01 * sign, 0.75});
  }
  const ExposureNoise noise = EstimateExposureNoise(residuals, 255, 8);
  ASSERT_EQ(noise.code.size(), 2u);
  EXPECT_EQ(noise.code[0], 20);
  EXPECT_EQ(noise.code[1], 230);
  EXPECT_NEAR(noise.sigma[0], 0.2 / std::sqrt(0.99501), 1e-9);
  EXPECT_NEAR(noise.sigma[1], 0.02 / std::sqrt(0.99501), 1e-9);  // 1 / sqrt(1 - leverage) = 2

  residuals.resize(39);
  EXPECT_TRUE(EstimateExposureNoise(residuals, 255, 8).code.empty());
}

// One far off among 40 counts as 3 standard deviations: v = (39 a^2 + 9 v) / (40 * 0.99501).
TEST(ExposureNoise, WhatIsFarOffCountsAsThreeStandardDeviations) {
  std::vector<ExposureResidual> residuals(39, {20, 0.2, 0});
  residuals.push_back({20, 100, 0});
  const ExposureNoise noise = EstimateExposureNoise(residuals, 255, 1);
  ASSERT_EQ(noise.sigma.size(), 1u);
  EXPECT_NEAR(noise.sigma[0], std::sqrt(39 * 0.2 * 0.2 / (40 * 0.99501 - 9)), 1e-9);
}

}  // namespace
}  // namespace luxfield::reconstruct
