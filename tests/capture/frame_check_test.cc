#include "luxfield/capture/take/frame_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "luxfield/core/random.h"

namespace luxfield::capture {
namespace {

constexpr int kSide = 1024;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
constexpr double kTolerance = 0.05;

rig::SensorModel Calibration() {
  rig::SensorModel c;
  c.black_dn = 100;
  c.saturation_dn = 4000;
  c.gain_dn_per_e = 0.5;
  c.read_noise_dn = 2;
  return c;
}

// Pixels of `rate(k)` DN per second, with noise.
template <typename Rate>
session::RawFrame Exposed(const Rate& rate, double exposure_s, std::uint64_t seed) {
  const rig::SensorModel c = Calibration();
  session::RawFrame frame;
  frame.width = frame.height = kSide;
  core::Random random(seed, 0);
  for (std::size_t k = 0; k < kPixels; ++k) {
    const double signal = rate(k) * exposure_s;
    const double noise =
        std::sqrt(c.read_noise_dn * c.read_noise_dn + c.gain_dn_per_e * signal) * random.Normal();
    frame.dn.push_back(static_cast<std::uint16_t>(
        std::lround(std::clamp(c.black_dn + signal + noise, 0.0, c.saturation_dn))));
  }
  return frame;
}

double Ramp(std::size_t k) { return 4000.0 * static_cast<double>(k) / kPixels; }

std::optional<double> Ratio(const session::RawFrame& frame, const session::RawFrame& shorter,
                            const std::vector<PixelRun>& usable = {{0, kPixels}}) {
  return LevelRatio(frame, 0.8, shorter, 0.4, usable, Calibration(), kTolerance);
}

TEST(FrameCheck, StatisticsAreThoseOfTheirDefinition) {
  hal::CameraCapabilities camera;
  camera.width = camera.height = kSide;
  rig::SensorModel c = Calibration();
  // Neighbours, the frame's ends, one twice, and one that is not on this sensor.
  c.defects = {{0, 0}, {5, 7}, {5, 8}, {5, 7}, {kSide - 1, kSide - 1}, {kSide, 3}};
  session::RawFrame frame = Exposed(Ramp, 1.2, 1);
  for (const auto& [row, column] : c.defects)
    if (row < kSide) frame.dn[static_cast<std::size_t>(row) * kSide + column] = 65535;
  const auto usable = UsablePixels(camera, c);
  for (const double black_dn : {-1.0, 0.0, 100.5, 65535.0})
    for (const double saturation_dn : {200.0, 3999.5, 4000.0, 65535.5}) {
      c.black_dn = black_dn;
      c.saturation_dn = saturation_dn;
      double sum = 0, count = 0, brightest = 0, saturated = 0, black = 0;
      for (std::size_t k = 0; k < kPixels; ++k) {
        const double dn = frame.dn[k];
        if (dn == 65535) continue;
        sum += dn, ++count, brightest = std::max(brightest, dn);
        saturated += dn >= saturation_dn, black += dn <= black_dn;
      }
      ASSERT_EQ(count, kPixels - 4);
      const FrameStatistics s = Measure(frame, usable, c);
      EXPECT_DOUBLE_EQ(s.mean_dn, sum / count);
      EXPECT_EQ(s.brightest_dn, brightest);
      EXPECT_DOUBLE_EQ(s.saturated_share, saturated / count);
      EXPECT_DOUBLE_EQ(s.black_share, black / count);
    }
}

TEST(FrameCheck, OneSaturatedPixelOfAFrameIsSeen) {
  session::RawFrame frame = Exposed([](std::size_t) { return 1000; }, 0.4, 1);
  ASSERT_EQ(Measure(frame, {{0, kPixels}}, Calibration()).saturated_share, 0);
  for (const std::size_t k : {std::size_t{0}, std::size_t{40000}, kPixels - 1}) {
    const std::uint16_t before = std::exchange(frame.dn[k], 4000);
    EXPECT_EQ(Measure(frame, {{0, kPixels}}, Calibration()).saturated_share, 1.0 / kPixels) << k;
    frame.dn[k] = before;
  }
}

TEST(FrameCheck, LevelsOfLargeFramesAgreeWithinTheStatedNoise) {
  const auto shorter = Exposed(Ramp, 0.4, 1);
  for (const double wrong : {0.8, 0.9425, 1.0, 1.0575, 1.5}) {
    const auto ratio = Ratio(Exposed(Ramp, 0.8 * wrong, 2), shorter);
    ASSERT_TRUE(ratio);
    EXPECT_NEAR(*ratio, wrong, 0.15 * kTolerance) << wrong;
    EXPECT_EQ(std::abs(*ratio - 1) > kTolerance, wrong != 1) << wrong;
  }
}

// The lamp goes out, or another exposure begins, while the frame is taken.
TEST(FrameCheck, APartOfAFrameThatIsWrongCountsByItsShare) {
  const auto even = [](std::size_t) { return 2000; };
  const auto shorter = Exposed(even, 0.4, 1);
  for (const double from : {0.0, 0.3, 0.7})
    for (const double share : {0.1, 0.2, 0.3}) {
      const auto begin = static_cast<std::size_t>(from * kPixels),
                 end = static_cast<std::size_t>((from + share) * kPixels);
      const auto partly = [&](std::size_t k) { return k >= begin && k < end ? 0 : 2000; };
      const auto ratio = Ratio(Exposed(partly, 0.8, 2), shorter);
      ASSERT_TRUE(ratio);
      EXPECT_NEAR(*ratio, 1 - share, 0.04) << "from " << from;
      EXPECT_GT(std::abs(*ratio - 1), kTolerance);
    }
}

// Smaller than the gaps between the pixels that are looked at first, wherever it lies.
TEST(FrameCheck, LevelsOfASmallSpotAreSeen) {
  for (const std::size_t begin : {std::size_t{0}, std::size_t{5000}, std::size_t{700'000}}) {
    const auto spot = [&](std::size_t k) { return k >= begin && k < begin + 20000 ? 2000 : 0; };
    const auto shorter = Exposed(spot, 0.4, 1);
    for (const double wrong : {0.9, 1.0, 1.1}) {
      const auto ratio = Ratio(Exposed(spot, 0.8 * wrong, 2), shorter);
      ASSERT_TRUE(ratio) << begin;
      EXPECT_NEAR(*ratio, wrong, 0.15 * kTolerance) << begin;
    }
  }
}

TEST(FrameCheck, TooLittleLightSaysNothing) {
  const auto dark = [](std::size_t) { return 0; };
  EXPECT_FALSE(Ratio(Exposed(dark, 0.8, 2), Exposed(dark, 0.4, 1)));
  const auto few = [](std::size_t k) { return k < 99 ? 2000 : 0; };
  EXPECT_FALSE(Ratio(Exposed(few, 0.8, 2), Exposed(few, 0.4, 1)));
}

TEST(FrameCheck, DefectsDoNotCountForLevels) {
  session::RawFrame shorter = Exposed(Ramp, 0.4, 1), frame = Exposed(Ramp, 0.8, 2);
  for (std::size_t k = 0; k < kPixels; k += 2) frame.dn[k] = shorter.dn[k] = 1500;
  std::vector<PixelRun> usable;
  for (std::size_t k = 1; k < kPixels; k += 2) usable.push_back({k, k + 1});
  const auto all = Ratio(frame, shorter), counted = Ratio(frame, shorter, usable);
  ASSERT_TRUE(all && counted);
  EXPECT_GT(std::abs(*all - 1), kTolerance);
  EXPECT_NEAR(*counted, 1, 0.15 * kTolerance);
}

// Two levels of an ideal camera, which has no ADC and no bound.
TEST(FrameCheck, FramesOfRealNumbersAreCheckedLikewise) {
  rig::SensorModel c = Calibration();
  c.saturation_dn = 1e9;
  const auto frame = [](float level) {
    session::RawFrame f;
    f.width = f.height = 300;
    f.value.assign(90000, level);
    return f;
  };
  const auto usable = std::vector<PixelRun>{{0, 90000}};
  const FrameStatistics s = Measure(frame(0.25f), usable, c);
  EXPECT_EQ(s.mean_dn, 0.25);
  EXPECT_EQ(s.brightest_dn, 0.25);
  EXPECT_EQ(s.black_share, 1);
  const auto ratio = LevelRatio(frame(1700), 0.8, frame(1100), 0.4, usable, c, kTolerance);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(*ratio, 0.8, 1e-9);
}

}  // namespace
}  // namespace luxfield::capture
