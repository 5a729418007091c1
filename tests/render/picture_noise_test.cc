// What is said of a picture's noise, against made-up noise that is known.
#include "luxfield/render/accuracy/picture_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/random.h"

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 11;

// A frame of `passes` passes of normal noise about 1; the noise of pixel k has the variance
// 1 / (1 + k) for one pass.
struct MadeUp {
  render::Frame frame;
  double true_mse = 0;
};

MadeUp MakeUp(int pixels, int passes, std::uint64_t stream) {
  core::Random random(kSeed, stream);
  MadeUp made;
  made.frame.radiance = core::Image(pixels, 1, 3);
  made.frame.variance = core::Image(pixels, 1, 1);
  for (int k = 0; k < pixels; ++k) {
    double sum = 0, squares = 0;
    for (int pass = 0; pass < passes; ++pass) {
      const double e = random.Normal() / std::sqrt(1.0 + k);
      sum += e;
      squares += e * e;
    }
    const double mean = sum / passes;
    for (int c = 0; c < 3; ++c) made.frame.radiance.plane(c)[k] = static_cast<float>(1 + mean);
    made.frame.variance.data[k] =
        static_cast<float>((squares - sum * mean) / (passes * (passes - 1.0)));
    made.true_mse += mean * mean / pixels;
  }
  return made;
}

TEST(PictureNoise, MarginHoldsInNinetyFivePercent) {
  for (const int passes : {2, 4}) {
    constexpr int kRuns = 1000, kPixels = 300;
    double v = 0, v2 = 0;
    for (int k = 0; k < kPixels; ++k) {
      v += 1 / (1.0 + k);
      v2 += std::pow(1 / (1.0 + k), 2);
    }
    const double pixels = v * v / v2;  // 24
    int within = 0;
    double effective = 0;
    for (int run = 0; run < kRuns; ++run) {
      const MadeUp made = MakeUp(kPixels, passes, static_cast<std::uint64_t>(run));
      const PictureNoise noise = NoiseOf(made.frame, passes - 1);
      within += made.true_mse <= noise.Margin() * noise.mean_variance;
      effective += noise.effective_pixels / kRuns;
    }
    std::printf("%d passes: within the margin in %.1f %%, effective pixels %.1f of %.1f\n", passes,
                0.1 * within, effective, pixels);
    // Standard deviation of the count: 7.
    EXPECT_GE(within, 900);
    EXPECT_LE(within, 990);
    EXPECT_NEAR(effective, pixels, 0.5 * pixels);
  }
}

// Variances that are scaled down by a factor of which nothing is known are bounded by what they
// were.
TEST(PictureNoise, DoubtfulFactorsAreNotTrusted) {
  PictureNoise noise;
  noise.effective_pixels = 50;
  noise.degrees = 1000;
  const double plain = noise.Margin();
  noise.scale = 0.25;
  EXPECT_DOUBLE_EQ(noise.Margin(), plain);
  noise.scale_log_variance = 0.01;
  EXPECT_GT(noise.Margin(), plain);
  EXPECT_LT(noise.Margin(), 1.5 * plain);
  noise.scale_log_variance = 100;
  EXPECT_DOUBLE_EQ(noise.Margin(), 4 * plain);
}

TEST(VarianceLaw, FollowsItsPoints) {
  VarianceLaw law;
  EXPECT_EQ(law.Of(3), 0);
  law.Add(8, 1);
  EXPECT_DOUBLE_EQ(law.Of(16), 0.5);
  law.Add(32, 0.125);  // power 1.5
  EXPECT_NEAR(law.Of(16), std::pow(2, -1.5), 1e-12);
  EXPECT_NEAR(law.Of(4), std::pow(2, 1.5), 1e-12);
  EXPECT_NEAR(law.Of(128), 0.125 / 8, 1e-12);
  law.Anchor(32, 0.25);
  EXPECT_DOUBLE_EQ(law.Of(32), 0.25);
  EXPECT_DOUBLE_EQ(law.Of(8), 2);
  law.Add(64, 0.125);  // no rise, and no steeper than allowed
  EXPECT_NEAR(law.Of(256) / law.Of(128), std::pow(2, -0.8), 1e-12);
}

}  // namespace
}  // namespace luxfield::render
