// Where samples go, on made-up pictures whose best answer is known.
#include "luxfield/render/accuracy/sample_density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "luxfield/core/random.h"

namespace luxfield::render {
namespace {

constexpr int kWidth = 33, kHeight = 8, kGap = 16;  // nothing is hit in the column kGap

// Two halves that do not touch, of the luminances and of the standard deviations that one sample
// leaves; `samples` a pixel.
render::Frame Halves(double left_y, double left_sd, double right_y, double right_sd,
                     double samples) {
  render::Frame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.radiance = core::Image(kWidth, kHeight, 3);
  for (core::Image* image : {&frame.coverage, &frame.variance, &frame.samples})
    *image = core::Image(kWidth, kHeight, 1);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      if (column == kGap) continue;
      const bool left = column < kGap;
      for (int c = 0; c < 3; ++c)
        frame.radiance.at(c, row, column) = static_cast<float>(left ? left_y : right_y);
      frame.coverage.at(0, row, column) = 1;
      frame.samples.at(0, row, column) = static_cast<float>(samples);
      frame.variance.at(0, row, column) =
          static_cast<float>(std::pow(left ? left_sd : right_sd, 2) / samples);
    }
  return frame;
}

TEST(SampleDensity, EvenNoiseTakesEvenSamples) {
  const auto result = DensityFrom(Halves(2, 0.5, 2, 0.5, 7), 0.125);
  EXPECT_THAT(result.density.data, testing::Each(1.0f));
  EXPECT_DOUBLE_EQ(result.mean, 1);
  EXPECT_DOUBLE_EQ(result.variance, 1);
  EXPECT_NEAR(result.variance_of_one, 0.25 * (kWidth - 1.0) / kWidth, 1e-6);
}

// Noise in proportion to the luminance: Neyman's allocation is n ~ s. Powers of two stray from it
// by at most sqrt(2) either way, which costs at most (sqrt(2) + 1 / sqrt(2))^2 / 4 = 1.125.
TEST(SampleDensity, SamplesGoWhereTheNoiseIs) {
  for (const double ratio : {1.5, 3.0, 8.0, 40.0}) {
    const auto result = DensityFrom(Halves(1, 0.3, ratio, 0.3 * ratio, 16), 1e-3);
    const double best = std::pow(1 + ratio, 2) / (2 * (1 + ratio * ratio));
    std::printf("noise 1 to %g: squared error %.3f of even samples', at best %.3f\n", ratio,
                result.variance * result.mean, best);
    EXPECT_GE(result.variance * result.mean, best * (1 - 1e-5));
    EXPECT_LE(result.variance * result.mean, 1.125 * best);
    EXPECT_GT(result.density.at(0, 4, kWidth - 2), result.density.at(0, 4, 1) * ratio / 2);
  }
}

// A pilot that found no noise in the bright half (all of its few samples were alike) says little
// of the half: luminance keeps samples there.
TEST(SampleDensity, LuminanceStandsInForNoiseThatThePilotMissed) {
  const auto result = DensityFrom(Halves(100, 0, 1, 0.3, 16), 0.125);
  EXPECT_GE(result.density.at(0, 4, 1), 1);
  EXPECT_LE(result.density.at(0, 4, kWidth - 2), 4);
}

TEST(SampleDensity, NoPixelStarves) {
  const auto result = DensityFrom(Halves(0, 0, 1, 0.3, 16), 0.2);
  EXPECT_FLOAT_EQ(result.density.at(0, 4, 1), 0.25f);
  EXPECT_FLOAT_EQ(DensityFrom(Halves(0, 0, 1, 0.3, 16), 1).density.at(0, 4, 1), 1.0f);
}

// What a frame of uneven samples says of one sample is the same.
TEST(SampleDensity, AFramesOwnSamplesAreTakenOff) {
  auto frame = Halves(2, 0.5, 2, 0.5, 8);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kGap; ++column) {
      frame.samples.at(0, row, column) *= 4;
      frame.variance.at(0, row, column) /= 4;
    }
  EXPECT_THAT(DensityFrom(frame, 0.125).density.data, testing::Each(1.0f));
}

TEST(SampleDensity, WithoutNoiseSamplesAreEven) {
  EXPECT_TRUE(DensityFrom(Halves(1, 0, 5, 0, 16), 0.125).density.data.empty());
  EXPECT_TRUE(DensityFrom(Halves(0, 0, 0, 0, 16), 0.125).density.data.empty());
}

// Few values, all of them what the renderer takes, and never worse than even samples by more than
// rounding to powers of two costs.
TEST(SampleDensity, AnyNoiseGivesFewDensitiesThatAreWorthIt) {
  constexpr std::uint64_t kSeed = 5;
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    core::Random random(kSeed, stream);
    auto frame = Halves(1, 1, 1, 1, 8);
    const double spread = 6 * random.Uniform();
    for (std::size_t i = 0; i < frame.variance.data.size(); ++i)
      frame.variance.data[i] =
          static_cast<float>(frame.coverage.data[i] * std::exp(spread * random.Normal()));
    const auto result = DensityFrom(frame, 0.125);
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", stream " << stream);
    const std::set<float> values(result.density.data.begin(), result.density.data.end());
    EXPECT_LE(values.size(), 12u);
    EXPECT_GE(*values.begin(), 0.125f);
    EXPECT_LE(*values.rbegin(), 256.0f);
    EXPECT_LE(result.variance * result.mean, 1.125);
    render::RenderOptions options;
    options.sample_density = result.density;
    EXPECT_NO_THROW(options.Validate());
  }
}

}  // namespace
}  // namespace luxfield::render
