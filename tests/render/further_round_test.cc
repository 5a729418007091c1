// The samples that a picture lacks, on made-up pictures whose noise is known.
#include "luxfield/render/accuracy/further_round.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace luxfield::render {
namespace {

constexpr int kWidth = 64, kHeight = 32;

// Deviations of one sample: the right half is `ratio` times as noisy as the left one, and as bright.
double DeviationAt(int column, double ratio) { return column < kWidth / 2 ? 0.3 : 0.3 * ratio; }

core::Image EveryOther(float samples, int step) {
  core::Image taken(kWidth, kHeight, 1);
  for (int row = 0; row < kHeight; row += step)
    for (int column = 0; column < kWidth; column += step) taken.at(0, row, column) = samples;
  return taken;
}

Frame Halves(double ratio, const core::Image& taken) {
  Frame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.radiance = core::Image(kWidth, kHeight, 3);
  frame.coverage = frame.variance = core::Image(kWidth, kHeight, 1);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      frame.coverage.at(0, row, column) = 1;
      const float n = taken.at(0, row, column);
      if (n == 0) continue;
      const double s = DeviationAt(column, ratio);
      for (int c = 0; c < 3; ++c) frame.radiance.at(c, row, column) = static_cast<float>(s / 0.3);
      frame.variance.at(0, row, column) = static_cast<float>(s * s / n);
    }
  return frame;
}

VarianceLaw PowerLaw(double power) {
  VarianceLaw law;
  law.Add(1, 1);
  law.Add(64, std::pow(64, -power));
  return law;
}

double MeanOver(const core::Image& image, int begin, int end) {
  double sum = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int column = begin; column < end; ++column) sum += image.at(0, row, column);
  return sum / (kHeight * (end - begin));
}

// Numbers are even powers of two, and so within a factor of sqrt(2) of the best ones.
TEST(PlanFurtherRound, ReachesTheAimWithSamplesInProportionToTheNoise) {
  for (const double ratio : {1.0, 4.0, 16.0}) {
    const core::Image taken = EveryOther(8, 2);
    const double aim = 0.3 * 0.3 * ratio / 200;
    const FurtherRound round =
        PlanFurtherRound(Halves(ratio, taken), taken, PowerLaw(1), {.variance = aim});
    const core::Image added = SamplesOf(round);
    double variance = 0, samples = 0;
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column) {
        const double n = taken.at(0, row, column) + added.at(0, row, column);
        ASSERT_GE(n, 2);
        variance += std::pow(DeviationAt(column, ratio), 2) / n / (kWidth * kHeight);
        samples += added.at(0, row, column);
      }
    // Means beside the border of the halves are off there.
    EXPECT_NEAR(variance, round.variance, 0.1 * round.variance);
    EXPECT_LE(round.variance, aim);
    EXPECT_NEAR(round.samples, samples / (kWidth * kHeight), 1e-6 * samples);
    const double best = std::pow(0.3 * (1 + ratio) / 2, 2) / aim;
    std::printf("noise 1 to %g: %.1f samples with the pilot's, at best %.1f\n", ratio,
                round.samples + 2, best);
    EXPECT_LE(round.samples + 2, 1.5 * best);
    EXPECT_NEAR(std::log2(MeanOver(added, 40, 64) / MeanOver(added, 0, 24) / ratio), 0, 0.6);
  }
}

TEST(PlanFurtherRound, LeavesOutPixelsThatHaveEnough) {
  const core::Image taken = EveryOther(64, 1);
  const FurtherRound round = PlanFurtherRound(Halves(20, taken), taken, PowerLaw(1),
                                              {.variance = 0.1 * 0.5 * 36 / 64, .least = 8});
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth / 2 - 2; ++column)
      ASSERT_EQ(round.density.at(0, row, column), 0);
    for (int column = kWidth / 2 + 2; column < kWidth; ++column)
      ASSERT_GT(round.density.at(0, row, column), 0);
  }
  EXPECT_NEAR(round.lit, 0.5, 0.04);
}

// Or the mean of its samples and of those that it asks for were biased.
TEST(PlanFurtherRound, APixelDoesNotAskItself) {
  const core::Image taken = EveryOther(8, 1);
  Frame frame = Halves(1, taken);
  frame.variance.at(0, 10, 20) *= 1000;
  for (int c = 0; c < 3; ++c) frame.radiance.at(c, 10, 20) *= 50;
  const FurtherRound round = PlanFurtherRound(frame, taken, PowerLaw(1), {.variance = 0.09 / 100});
  EXPECT_EQ(round.density.at(0, 10, 20), round.density.at(0, 25, 50));
  EXPECT_GT(round.density.at(0, 10, 21), 2 * round.density.at(0, 25, 50));
}

// (n^2 v(n) + m^2 v(m)) / (n + m)^2 with v by the law.
TEST(PlanFurtherRound, FollowsTheLaw) {
  const core::Image taken = EveryOther(8, 1);
  for (const double power : {0.8, 1.0, 1.5}) {
    const FurtherRound round =
        PlanFurtherRound(Halves(1, taken), taken, PowerLaw(power), {.variance = 0.09 / 60});
    const double m = SamplesOf(round).at(0, 5, 5), of_one = 0.09,
                 of_m = of_one / 8 * std::pow(m / 8, -power);
    EXPECT_NEAR(round.variance, (8 * of_one + m * m * of_m) / std::pow(8 + m, 2),
                1e-4 * round.variance);
    EXPECT_LE(round.variance, 0.09 / 60);
  }
}

// Densities that the renderer takes, however unlike the pixels are.
TEST(PlanFurtherRound, NeverAsksForMoreThanTheMost) {
  const core::Image taken = EveryOther(8, 2);
  const FurtherRound round = PlanFurtherRound(Halves(1000, taken), taken, PowerLaw(1),
                                              {.variance = 1e-12, .unit = 4, .most = 1 << 14});
  const core::Image added = SamplesOf(round);
  EXPECT_THAT(added.data, testing::Each(testing::Le(1 << 15)));
  EXPECT_THAT(round.density.data,
              testing::Each(testing::AllOf(testing::Ge(1e-3f), testing::Le(1e3f))));
}

}  // namespace
}  // namespace luxfield::render
