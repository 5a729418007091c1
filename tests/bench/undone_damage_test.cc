#include "luxfield/bench/undone_damage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::bench {
namespace {

TEST(UndoneDamage, IsTheExcessInQuadrature) {
  // Sums 4, 4 + 9 and 4 + 2.25: d = 3 and 1.5.
  const std::vector<double> signed_c{1, 3}, worse{5, 8}, better{6, 0.25};
  EXPECT_NEAR(UndoneDamage({signed_c, worse, better}, 1).share, 0.5, 1e-15);
  EXPECT_NEAR(UndoneDamage({signed_c, worse, worse}, 1).share, 0, 1e-15);
  EXPECT_EQ(UndoneDamage({signed_c, worse, signed_c}, 1).share, 1);
  // Nearer than signed C counts as all, and where nothing is lost there is no share.
  const std::vector<double> none{1, 2};
  EXPECT_EQ(UndoneDamage({signed_c, worse, none}, 1).share, 1);
  EXPECT_TRUE(std::isnan(UndoneDamage({signed_c, none, none}, 1).share));
  EXPECT_TRUE(std::isnan(UndoneDamage({signed_c, none, none}, 1).low));
  EXPECT_TRUE(std::isnan(UndoneDamage({signed_c, none, none}, 1).high));
}

// Errors whose population has a share that is known: signed C of exponential squares of mean 1,
// the others' excesses exponential of means 1 and 0.36, so that the share is 0.4. The interval
// leaves it out in about a tenth of the samples, and narrows as 1 / sqrt(receivers).
TEST(UndoneDamage, IntervalHoldsTheShareOfThePopulation) {
  constexpr int kSamples = 300;
  double width_before = 0;
  for (const int receivers : {100, 400}) {
    int held = 0;
    double width = 0;
    for (int sample = 0; sample < kSamples; ++sample) {
      core::Random random(7, receivers, static_cast<std::uint32_t>(sample));
      const auto exponential = [&] { return -std::log1p(-random.Uniform()); };
      std::vector<double> signed_c, worse, better;
      for (int k = 0; k < receivers; ++k) {
        signed_c.push_back(exponential());
        worse.push_back(signed_c.back() + exponential());
        better.push_back(signed_c.back() + 0.36 * exponential());
      }
      const UndoneShare undone = UndoneDamage({signed_c, worse, better}, sample + 1);
      EXPECT_LE(undone.low, undone.share);
      EXPECT_GE(undone.high, undone.share);
      held += undone.low <= 0.4 && 0.4 <= undone.high;
      width += (undone.high - undone.low) / kSamples;
    }
    std::printf("%d receivers (seed 7): 0.4 held in %d of %d, width %.3f\n", receivers, held,
                kSamples, width);
    // Binomial: 270 +- 5.2 of an exact interval. The percentile interval's own error is of order
    // 1 / receivers.
    EXPECT_NEAR(held, 0.9 * kSamples, 4 * 5.2 + 0.02 * kSamples);
    if (width_before > 0) {
      EXPECT_NEAR(width_before / width, 2, 0.1);
    }
    width_before = width;
  }
}

}  // namespace
}  // namespace luxfield::bench
