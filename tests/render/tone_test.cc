// Tone operators keep colours and are the curves that they state.
#include "luxfield/render/film/tone.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/random.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

using core::Rgb;
using Operator = Rgb (*)(const Rgb&, double, double);

TEST(Tone, ChannelsKeepTheirRatiosAndCanBeShown) {
  core::Random random(TestSeed(21), 0);
  for (const Operator tone : {&ExponentialHueTone, &FilmicTone})
    for (int i = 0; i < 2000; ++i) {
      Rgb linear{};
      for (double& value : linear) value = std::pow(10, 6 * random.Uniform() - 3);
      const Rgb shown = tone(linear, 1, 1);
      for (int c = 0; c < 3; ++c) {
        ASSERT_GE(shown[c], 0);
        ASSERT_LE(shown[c], 1);
        ASSERT_NEAR(shown[c] * linear[0], shown[0] * linear[c], 1e-9 * linear[0] * linear[c]);
      }
    }
}

// The exponential operator of each channel makes it pink.
TEST(Tone, ABrightRedStaysRed) {
  const Rgb red{20, 1, 1};
  EXPECT_GT(core::ExponentialTone(red, 1, 1)[1], 0.6);
  for (const Operator tone : {&ExponentialHueTone, &FilmicTone}) {
    const Rgb shown = tone(red, 1, 1);
    EXPECT_GT(shown[0], 0.8);
    EXPECT_NEAR(shown[1], shown[0] / 20, 1e-12);
  }
}

TEST(Tone, TheLargestChannelIsThatOfTheCurve) {
  core::Random random(TestSeed(22), 0);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::pow(10, 4 * random.Uniform() - 2), average = 0.5 + random.Uniform();
    const Rgb linear{0.1 * value, value, 0.7 * value};
    EXPECT_NEAR(ExponentialHueTone(linear, 2, average)[1], 1 - std::exp(-2 * value / average),
                1e-12);
    const double x = 0.18 * 2 * value / average;
    EXPECT_NEAR(FilmicTone(linear, 2, average)[1],
                std::min(1.0, (2.51 * x * x + 0.03 * x) / (2.43 * x * x + 0.59 * x + 0.14)), 1e-12);
  }
}

TEST(Tone, OfAGreyItIsTheExponentialOperator) {
  const Rgb grey{0.7, 0.7, 0.7};
  const Rgb plain = core::ExponentialTone(grey, 1.5, 0.4),
            kept = ExponentialHueTone(grey, 1.5, 0.4);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(plain[c], kept[c], 1e-12);
}

TEST(Tone, WhatIsNotLitIsBlack) {
  for (const Operator tone : {&ExponentialHueTone, &FilmicTone}) {
    EXPECT_EQ(tone({0, 0, 0}, 1, 1), (Rgb{0, 0, 0}));
    EXPECT_EQ(tone({-1, -2, -1}, 1, 1), (Rgb{0, 0, 0}));
    EXPECT_EQ(tone({1, 2, 1}, 1, 0), (Rgb{0, 0, 0}));
    const Rgb bright = tone({1e30, 1e30, 1e30}, 1, 1);
    for (const double value : bright) EXPECT_NEAR(value, 1, 0.02);
  }
}

}  // namespace
}  // namespace luxfield::render
