// Measures and colours against values worked out by hand or published.
#include "luxfield/core/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/clock.h"
#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/progress.h"

namespace luxfield::core {
namespace {

Image Grey(std::vector<float> values) {
  Image image(static_cast<int>(values.size()), 1, 1);
  image.data = std::move(values);
  return image;
}

TEST(Compare, HandComputed) {
  // b = 1, 3; a - b = 1, -2. mean b = 2, RMSE = sqrt(5/2).
  const Difference d = Compare(Grey({2, 1}), Grey({1, 3}));
  EXPECT_NEAR(d.mean_reference, 2, 1e-15);
  EXPECT_NEAR(d.rel_rmse, std::sqrt(2.5) / 2, 1e-15);
  EXPECT_NEAR(d.bias, -0.25, 1e-15);
  EXPECT_EQ(d.max_abs, 2);
  const double eps = 0.02 * 0.02;
  EXPECT_NEAR(d.rel_mse, 0.5 * (1 / (1 + eps) + 4 / (9 + eps)), 1e-15);
  // Tone 1 - exp(-L/2) of a grey has a = b = 0 and L* = 116 cbrt(Y) - 16 above the linear toe.
  const auto lightness = [](double x) { return 116 * std::cbrt(1 - std::exp(-x / 2)) - 16; };
  const double expected = 0.5 * (lightness(2) - lightness(1) + lightness(3) - lightness(1));
  EXPECT_NEAR(d.mean_lab, expected,
              2e-3);  // float pixels; published matrices sum to white within 1e-7
}

TEST(Compare, EqualImagesDifferByNothing) {
  for (const auto& values : {std::vector<float>{0, 0}, {1, 2}, {-1, 5}}) {
    const Difference d = Compare(Grey(values), Grey(values));
    EXPECT_EQ(d.rel_rmse, 0);
    EXPECT_EQ(d.rel_mse, 0);
    EXPECT_EQ(d.bias, 0);
    EXPECT_EQ(d.max_abs, 0);
    EXPECT_EQ(d.mean_lab, 0);
  }
}

TEST(Compare, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(Compare(Grey({1}), Grey({1, 2})), InputError);
  EXPECT_THROW(Compare(Image(1, 1, 3), Image(1, 1, 1)), InputError);
  EXPECT_THROW(Compare(Grey({NAN}), Grey({1})), InputError);
  EXPECT_THROW(Compare(Grey({1}), Grey({INFINITY})), InputError);
}

TEST(LabDifference, IsPerPixel) {
  Image a(2, 1, 3), b(2, 1, 3);
  for (float& v : a.data) v = 1;
  b.data = a.data;
  b.at(2, 0, 1) = 0;  // no blue in the second pixel
  const Image d = LabDifference(a, b);
  EXPECT_EQ(d.channels, 1);
  EXPECT_EQ(d.at(0, 0, 0), 0);
  EXPECT_GT(d.at(0, 0, 1), 10);
}

// Bruce Lindbloom's calculator, sRGB primaries, D65.
TEST(Colour, LabOfKnownColours) {
  const auto expect = [](Rgb rgb, double l, double a, double b) {
    const Rgb lab = LabFromLinear(rgb);
    EXPECT_NEAR(lab[0], l, 0.01);
    EXPECT_NEAR(lab[1], a, 0.02);
    EXPECT_NEAR(lab[2], b, 0.02);
  };
  expect({1, 1, 1}, 100, 0, 0);
  expect({0, 0, 0}, 0, 0, 0);
  expect({1, 0, 0}, 53.24, 80.09, 67.20);
  expect({0, 1, 0}, 87.73, -86.18, 83.18);
  expect({0, 0, 1}, 32.30, 79.19, -107.86);
}

TEST(Colour, SrgbEncodeIsTheStandard) {
  EXPECT_EQ(SrgbEncode(-1), 0);
  EXPECT_EQ(SrgbEncode(0), 0);
  EXPECT_NEAR(SrgbEncode(1), 1, 1e-15);
  EXPECT_NEAR(SrgbEncode(7), 1, 1e-15);
  EXPECT_NEAR(SrgbEncode(0.0031308), 0.0404499, 1e-6);  // where both branches meet
  EXPECT_NEAR(SrgbEncode(0.214041), 0.5, 1e-5);
}

// The standard's decoding of each of the 256 codes (IEC 61966-2-1, 5.2) is undone. Its constants
// are rounded, so that the branches part by 3e-8 where they meet.
TEST(Colour, SrgbEncodeUndoesTheStandardsDecoding) {
  for (int code = 0; code < 256; ++code) {
    const double encoded = code / 255.0;
    const double linear =
        encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(SrgbEncode(linear), encoded, 1e-7) << code;
  }
}

TEST(Colour, ExponentialToneAndLuminance) {
  EXPECT_NEAR(ExponentialTone({2, 0, -1}, 3, 6)[0], 1 - std::exp(-1), 1e-15);
  EXPECT_EQ(ExponentialTone({2, 0, -1}, 3, 6)[2], 0);
  EXPECT_EQ(ExponentialTone({1, 1, 1}, 1, 0)[0], 0);  // a black reference
  EXPECT_NEAR(Luminance({1, 2, 3}), 0.2126 + 2 * 0.7152 + 3 * 0.0722, 1e-15);
}

TEST(Colour, FalseColourGrowsBrighter) {
  double previous = -1;
  for (double t = -0.1; t <= 1.1; t += 0.01) {
    const Rgb c = FalseColour(t);
    const double y = Luminance(c);
    EXPECT_GE(y, previous - 1e-12) << t;
    previous = y;
    for (const double v : c) EXPECT_TRUE(v >= 0 && v <= 1);
  }
}

TEST(Duration, ReadsLikeATimetable) {
  EXPECT_EQ(FormatDuration(0.04), "0.0 s");
  EXPECT_EQ(FormatDuration(12), "12 s");
  EXPECT_EQ(FormatDuration(200), "3 min 20 s");
  EXPECT_EQ(FormatDuration(7500), "2 h 05 min");
  EXPECT_EQ(FormatDuration(-1), "0.0 s");
  EXPECT_EQ(FormatDuration(NAN), "0.0 s");
}

TEST(SimulatedClock, MovesWhenAskedOnly) {
  SimulatedClock clock;
  EXPECT_EQ(clock.MonotonicSeconds(), 0);
  EXPECT_EQ(clock.UtcIso8601(), "2000-01-01T00:00:00.000Z");
  clock.SleepSeconds(86400 + 0.25);
  clock.SleepSeconds(-5);
  EXPECT_EQ(clock.MonotonicSeconds(), 86400.25);
  EXPECT_EQ(clock.UtcIso8601(), "2000-01-02T00:00:00.250Z");
}

TEST(ParallelFor, CoversEverythingOnceAndPassesExceptionsOn) {
  std::vector<int> hits(1000);
  ParallelFor(hits.size(), 7, [&](std::size_t begin, std::size_t end) {
    EXPECT_LE(end - begin, 7u);
    for (std::size_t k = begin; k < end; ++k) ++hits[k];
  });
  for (const int count : hits) EXPECT_EQ(count, 1);
  ParallelFor(0, 1, [](std::size_t, std::size_t) { ADD_FAILURE(); });
  EXPECT_THROW(ParallelFor(10, 1, [](std::size_t, std::size_t) { throw InputError("x"); }),
               InputError);
}

TEST(Interrupt, OneCountStopsOtherVerbs) {
  SetInterruptCountForTest(0);
  EXPECT_NO_THROW(ThrowIfInterrupted());
  SetInterruptCountForTest(1);
  EXPECT_THROW(ThrowIfInterrupted(), Interrupted);
  SetInterruptCountForTest(0);
}

}  // namespace
}  // namespace luxfield::core
