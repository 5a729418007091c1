#include "luxfield/planning/relative_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::planning {
namespace {

TEST(RelativeRmse, OfTwoPlacesByHand) {
  const RelativeError error =
      RelativeRmse(std::vector<double>{1.25, 2.5}, std::vector<double>{1, 3});
  // Off by 0.25 and -0.5 about a mean of 2: R^2 = (0.0625 + 0.25) / 2 / 4.
  const double r2 = 0.0390625;
  EXPECT_DOUBLE_EQ(error.value, std::sqrt(r2));
  // Both residuals of R^2 are this large, with opposite signs: they add to nothing.
  const double z = 0.0625 / 4 - 2 * r2 * 0.5 + r2;
  EXPECT_DOUBLE_EQ(error.standard_error, std::abs(z) / (2 * error.value));
}

TEST(RelativeRmse, OfOnePlaceHasNoStandardError) {
  const RelativeError error = RelativeRmse(std::vector<double>{3}, std::vector<double>{2});
  EXPECT_DOUBLE_EQ(error.value, 0.5);
  EXPECT_EQ(error.standard_error, 0);
}

// The standard error against the spread over samples of places whose errors go with their light.
TEST(RelativeRmse, StandardErrorIsTheSpreadOverSamples) {
  constexpr int kSamples = 2000, kPlaces = 300;
  core::Random random(41, 0);
  std::vector<double> truth(kPlaces), values(kPlaces);
  double sum = 0, squares = 0, foretold = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    for (int k = 0; k < kPlaces; ++k) {
      truth[k] = 2 + 3 * random.Uniform();
      values[k] = truth[k] * (1 + 0.1 * random.Normal());
    }
    const RelativeError error = RelativeRmse(values, truth);
    sum += error.value / kSamples;
    squares += error.value * error.value / kSamples;
    foretold += error.standard_error / kSamples;
  }
  const double spread = std::sqrt(squares - sum * sum);
  std::printf("spread %.5f, foretold %.5f\n", spread, foretold);
  // 4.5 sigma of a spread of so many samples, 1 / sqrt(2 n), and the bias of order 1 / places.
  EXPECT_NEAR(foretold / spread, 1, 4.5 / std::sqrt(2.0 * kSamples) + 5.0 / kPlaces);
}

}  // namespace
}  // namespace luxfield::planning
