#include "luxfield/capture/lamp/lamp_frequency.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::capture {
namespace {

using testing::HasSubstr;

enum class Wave { kSquare, kSine, kRectifiedSine };

// A lamp's waveform, and how two bursts of 48 frames see it.
struct Scene {
  Wave wave = Wave::kSquare;
  double hz = 1000, duty = 0.5, depth = 1;
  double exposure_s = 0.02, readout_s = 0.03, drift_per_s = 2e-5;
  double noise = 3e-4;      // of a level, relative
  double jitter_s = 0;      // of the starts that are told, rms
  double clock_step_s = 0;  // starts are told in whole steps
  double longest_wait_s = 0.025;
  int frames = 48;

  // Power from 0 to so many periods; mean 1.
  double Energy(double periods) const {
    const double whole = std::floor(periods), part = periods - whole;
    if (wave == Wave::kSquare) return whole + std::min(part, duty) / duty;
    if (wave == Wave::kSine)
      return periods - 0.8 * std::cos(2 * std::numbers::pi * periods) / (2 * std::numbers::pi);
    return whole + 0.5 * (1 - std::cos(std::numbers::pi * part));
  }
  double Level(double start_s, double duration_s) const {
    const double begin = hz * start_s, periods = hz * duration_s;
    const double mean = (Energy(begin + periods) - Energy(begin)) / periods;
    return 1 + depth * (mean - 1);
  }
  std::vector<LevelBurst> Bursts(std::uint64_t seed) const {
    core::Random random(seed, 7);
    std::vector<LevelBurst> bursts;
    double t_s = 10 * random.Uniform();
    for (const double shorter : {1.3247179, 1.7548777}) {
      LevelBurst& burst = bursts.emplace_back();
      const double duration_s = exposure_s / shorter;
      for (int n = 0; n < frames; ++n) {
        t_s += longest_wait_s * random.Uniform();
        const double level = (1 + drift_per_s * t_s) * Level(t_s, duration_s);
        burst.level.push_back(5e3 * level * (1 + noise * random.Normal()));
        const double told_s = t_s + jitter_s * random.Normal();
        burst.start_s.push_back(clock_step_s > 0 ? clock_step_s * std::floor(told_s / clock_step_s)
                                                 : told_s);
        t_s += duration_s + readout_s;
      }
    }
    return bursts;
  }
  // rms of the levels of one burst, relative, and of the one where it is larger.
  double Ripple() const {
    double most = 0;
    for (const double shorter : {1.3247179, 1.7548777}) {
      constexpr int kPhases = 500;
      double squares = 0;
      for (int n = 0; n < kPhases; ++n)
        squares += std::pow(Level((n + 0.5) / (kPhases * hz), exposure_s / shorter) - 1, 2);
      most = std::max(most, std::sqrt(squares / kPhases));
    }
    return most;
  }
};

TEST(LampFrequency, IsThatOfTheLampWithinItsStandardError) {
  for (const Wave wave : {Wave::kSquare, Wave::kSine, Wave::kRectifiedSine})
    for (const double hz : {61.7, 1234.567, 19'876.5}) {
      Scene scene;
      scene.wave = wave;
      scene.hz = hz;
      scene.duty = 0.3;
      scene.exposure_s = 0.011;
      const LampFrequency found = FrequencyOf(scene.Bursts(3));
      EXPECT_NEAR(found.hz, hz, 5 * found.sigma_hz) << found.why;
      EXPECT_GT(found.sigma_hz, 0);
      EXPECT_LT(found.sigma_hz, 1e-4 * hz);
      EXPECT_LT(found.false_alarm, kFalseAlarm);
    }
}

// Neither an overtone nor a part of it, however the waveform's harmonics lie: a short pulse has
// many, a symmetric one the odd ones alone, a rectified sine looks like half of its frequency.
TEST(LampFrequency, IsTheFundamental) {
  for (const double duty : {0.06, 1.0 / 3, 0.5, 0.94}) {
    Scene scene;
    scene.hz = 217.3;
    scene.duty = duty;
    EXPECT_NEAR(FrequencyOf(scene.Bursts(1)).hz, 217.3, 0.02) << duty;
  }
}

// An exposure of whole periods sees nothing; the other one does.
TEST(LampFrequency, OneExposureOfWholePeriodsDoesNotHideIt) {
  Scene scene;
  scene.exposure_s = 0.02 * 1.3247179;
  scene.hz = 1000;
  scene.duty = 0.4;
  EXPECT_NEAR(FrequencyOf(scene.Bursts(1)).hz, 1000, 0.02);
}

TEST(LampFrequency, NoiseAndDriftHaveNone) {
  int found = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Scene scene;
    scene.depth = 0;
    scene.drift_per_s = 1e-3;
    const LampFrequency f = FrequencyOf(scene.Bursts(seed));
    found += f.hz > 0;
    EXPECT_THAT(f.why, HasSubstr("none from 40 to 25000 Hz"));
  }
  EXPECT_EQ(found, 0) << "at one in a million each";
  Scene equal;
  equal.depth = equal.noise = equal.drift_per_s = 0;
  EXPECT_THAT(FrequencyOf(equal.Bursts(1)).why, HasSubstr("equal"));
}

// A clock that is off by more than a part of a period tells nothing of so high a frequency, and all
// of a low one.
TEST(LampFrequency, TimesThatAreTooInexactForItAreNoNumber) {
  Scene scene;
  scene.duty = 0.3;
  scene.jitter_s = 1e-3;
  for (const double hz : {2000.0, 8000.0}) {
    scene.hz = hz;
    const LampFrequency f = FrequencyOf(scene.Bursts(1));
    EXPECT_EQ(f.hz, 0);
    EXPECT_THAT(f.why, HasSubstr("known too inexactly"));
  }
  scene.hz = 60.3;
  scene.jitter_s = 1e-4;
  EXPECT_NEAR(FrequencyOf(scene.Bursts(1)).hz, 60.3, 0.01);
}

// Frequencies a step of the clock apart explain the same.
TEST(LampFrequency, AClockOfWholeMillisecondsLeavesItOpen) {
  Scene scene;
  scene.hz = 123.4;
  scene.clock_step_s = 1e-3;
  const LampFrequency f = FrequencyOf(scene.Bursts(1));
  EXPECT_EQ(f.hz, 0);
  EXPECT_THAT(f.why, HasSubstr("about equally well"));
}

TEST(LampFrequency, PulsesThatFewFramesCatchAreNoNumber) {
  Scene scene;
  scene.hz = 47;
  scene.duty = 0.02;
  scene.exposure_s = 4e-4;
  const LampFrequency f = FrequencyOf(scene.Bursts(1));
  EXPECT_EQ(f.hz, 0);
  EXPECT_THAT(f.why, HasSubstr("too few frames catch a pulse"));
}

// Lamps, exposures and clocks at random: never a wrong number, and none where there should be one
// only if the clock jitters. LUXFIELD_LAMPS asks for more.
// Two digits of the standard error, none before the point, nine behind it at most.
TEST(LampFrequency, IsPrintedWithTheDigitsThatItsErrorAllows) {
  EXPECT_EQ(FormatHertz(217.300412, 0.0003), "217.30041 Hz (standard error 0.0003 Hz)");
  EXPECT_EQ(FormatHertz(99.96, 0.2), "99.96 Hz (standard error 0.2 Hz)");
  EXPECT_EQ(FormatHertz(100.26, 2), "100.3 Hz (standard error 2 Hz)");
  EXPECT_EQ(FormatHertz(100.26, 200), "100 Hz (standard error 2e+02 Hz)");
  EXPECT_EQ(FormatHertz(100, 1e-12), "100.000000000 Hz (standard error 1e-12 Hz)");
}

TEST(LampFrequency, IsRightOrNoNumberForLampsAtRandom) {
  const char* asked = std::getenv("LUXFIELD_LAMPS");
  const int lamps = asked ? std::atoi(asked) : 12;
  int right = 0, none = 0, none_steady = 0;
  double z2 = 0, worst = 0;
  for (int lamp = 0; lamp < lamps; ++lamp) {
    core::Random random(2026, static_cast<std::uint64_t>(lamp));
    const auto between = [&](double low, double high) {
      return low * std::pow(high / low, random.Uniform());
    };
    Scene scene;
    scene.wave = static_cast<Wave>(static_cast<int>(3 * random.Uniform()));
    scene.hz = between(50, 20e3);
    scene.duty = 0.05 + 0.9 * random.Uniform();
    scene.depth = between(0.1, 1);
    scene.exposure_s = between(8e-3, 40e-3);
    scene.readout_s = between(1e-3, 0.1);
    scene.noise = between(1e-5, 1e-3);
    scene.jitter_s = std::vector{0.0, 1e-6, 20e-6, 1e-3}.at(lamp % 4);
    const LampFrequency found = FrequencyOf(scene.Bursts(static_cast<std::uint64_t>(lamp)));
    const bool plain = scene.jitter_s * scene.hz < 0.02 && scene.Ripple() > 3 * scene.noise;
    if (found.hz == 0) {
      ++none;
      none_steady += plain;
      continue;
    }
    const double z = (found.hz - scene.hz) / found.sigma_hz;
    EXPECT_LT(std::abs(found.hz / scene.hz - 1), 1e-3) << fmt::format(
        "lamp {}: {} Hz, waveform {}, duty {:.3f}, depth {:.3f}, exposure {:.5f} s", lamp, scene.hz,
        static_cast<int>(scene.wave), scene.duty, scene.depth, scene.exposure_s);
    ++right;
    z2 += z * z;
    worst = std::max(worst, std::abs(z));
  }
  fmt::print(
      "{} lamps: {} right, {} no number ({} of a steady clock and visible pulses); mean "
      "squared error over variance {:.3f}, worst {:.2f} standard errors\n",
      lamps, right, none, none_steady, z2 / right, worst);
  EXPECT_LE(none_steady, lamps / 100);
  EXPECT_GT(right, lamps / 4);
  EXPECT_LT(z2 / right, 1 + 5 * std::sqrt(2.0 / right));
  EXPECT_LT(worst, 6);
}

}  // namespace
}  // namespace luxfield::capture
