#include "capture/flicker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

hal::CameraCalibration Camera() {
  hal::CameraCalibration c;
  c.black_dn = 100;
  c.gain_dn_per_e = 0.5;
  c.read_noise_dn = 2;
  return c;
}

constexpr double kPixels = 1000, kSignal = 800;
// Of a frame's mean level: photons, read-out, rounding.
double NoiseOf(double signal_dn) { return std::sqrt((0.5 * signal_dn + 4 + 1.0 / 12) / kPixels); }

std::vector<double> Levels(int frames, double scatter, double slope, std::uint64_t seed) {
  core::Random random(seed, 1);
  std::vector<double> levels;
  for (int n = 0; n < frames; ++n)
    levels.push_back(100 + kSignal * (1 + scatter * random.Normal() + slope * n) +
                     NoiseOf(kSignal) * random.Normal());
  return levels;
}

// The estimate over many bursts: unbiased in scatter^2, with the standard error that it states.
TEST(Flicker, ScatterIsWhatNoiseDoesNotExplain) {
  constexpr int kBursts = 400, kFrames = 24;
  for (const double truth : {0.0, 0.002, 0.02}) {
    double sum = 0, z2 = 0;
    const double noise2 = std::pow(NoiseOf(kSignal) / kSignal, 2), all = truth * truth + noise2;
    for (std::uint64_t burst = 0; burst < kBursts; ++burst) {
      const Scatter s = ScatterOf(Levels(kFrames, truth, 0, burst), kPixels, Camera());
      EXPECT_TRUE(s.light);
      EXPECT_NEAR(s.noise * s.noise, noise2, 0.02 * noise2);
      if (truth == 0) continue;
      sum += s.rms * s.rms;
      z2 += std::pow((s.rms * s.rms - truth * truth) / (all * std::sqrt(3.0 / (kFrames - 1))), 2);
    }
    if (truth == 0) continue;
    const double error = all * std::sqrt(3.0 / (kFrames - 1) / kBursts);
    EXPECT_NEAR(sum / kBursts, truth * truth, 4 * error);
    EXPECT_NEAR(z2 / kBursts, 1, 0.3);
  }
}

TEST(Flicker, NoiseAndSlowDriftAreNone) {
  int present = 0, hidden = 0;
  for (std::uint64_t burst = 0; burst < 400; ++burst) {
    present += ScatterOf(Levels(24, 0, 1e-4, burst), kPixels, Camera()).present;
    hidden += !ScatterOf(Levels(24, 0.003, 1e-4, burst), kPixels, Camera()).present;
  }
  EXPECT_LE(present, 4) << "of 400, beyond four standard errors of a skew variance";
  EXPECT_LE(hidden, 4) << "of 400 with four times the noise";
}

TEST(Flicker, TheDarkIsNoLight) {
  EXPECT_FALSE(ScatterOf(std::vector<double>(24, 100.05), kPixels, Camera()).light);
  EXPECT_FALSE(ScatterOf(std::vector<double>(24, 90), kPixels, Camera()).light);
}

// var(x) of a frame of n periods at a random phase, relative: with a = min(r, 1 - r),
// b = min(D, 1 - D), m and M the smaller and larger, (m^2 M - m^3 / 3 - (m M)^2) / (D n)^2.
double RmsOfPulses(double periods, double duty) {
  const double r = periods - std::floor(periods), a = std::min(r, 1 - r);
  const double b = std::min(duty, 1 - duty), m = std::min(a, b), big = std::max(a, b);
  return std::sqrt(m * m * big - m * m * m / 3 - std::pow(m * big, 2)) / (duty * periods);
}

TestLab Pulsing(double hz, double duty) {
  TestLab lab = Noisy();
  lab.errors += fmt::format("[errors.pwm]\nhz = {}\nduty = {}\n", hz, duty);
  return lab;
}

// What ends the capture, and the scatter in its journal.
struct Outcome {
  std::string error;
  double scatter = 0, exposure_s = 0;
};
Outcome CaptureOf(const TestLab& lab, double lab_states_hz, double plan_states_hz) {
  const auto folder = NewFolder("flicker");
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  devices.rig.pwm_hz = lab_states_hz;
  Plan plan = TestPlan();
  plan.exposure.pwm_hz = plan_states_hz;
  plan.exposure.flicker = 0.001;
  Outcome outcome;
  try {
    RunCapture(plan, devices, folder);
  } catch (const DeviceError& error) {
    outcome.error = error.what();
  }
  const auto records = RecordsOf(folder, "flicker");
  EXPECT_EQ(records.size(), 1u);
  outcome.scatter = records.at(0)["scatter"];
  outcome.exposure_s = records.at(0)["exposure_s"];
  return outcome;
}

class FlickerCapture : public Capture {};

TEST_F(FlickerCapture, AnUnstatedPulseIsFoundAndItsScatterMeasured) {
  for (const auto& [hz, duty] : {std::pair{61.3, 0.3}, {97.0, 0.6}, {203.7, 0.05}}) {
    const Outcome o = CaptureOf(Pulsing(hz, duty), 0, 0);
    EXPECT_THAT(o.error, testing::AllOf(HasSubstr("the lamp flickers"),
                                        HasSubstr("state its frequency as exposure.pwm_hz")));
    const double expected = RmsOfPulses(hz * o.exposure_s, duty);
    EXPECT_NEAR(o.scatter, expected, expected * 4 * 0.5 * std::sqrt(3.0 / 23))
        << hz << " Hz, duty " << duty << ", " << o.exposure_s << " s";
  }
}

TEST_F(FlickerCapture, AWrongFrequencyIsRefusedAndTheRightOneIsNot) {
  EXPECT_THAT(CaptureOf(Pulsing(61.3, 0.3), 0, 57).error, HasSubstr("correct pwm_hz = 57"));
  EXPECT_THAT(CaptureOf(Pulsing(61.3, 0.3), 57, 0).error, HasSubstr("correct pwm_hz = 57"));
  for (const double plan_hz : {0.0, 61.3}) {
    const Outcome o = CaptureOf(Pulsing(61.3, 0.3), plan_hz > 0 ? 0 : 61.3, plan_hz);
    EXPECT_EQ(o.error, "");
    EXPECT_LT(o.scatter, 0.001);
  }
}

TEST_F(FlickerCapture, ALampThatIsAlwaysOnDoesNotFlicker) {
  const Outcome o = CaptureOf(Pulsing(61.3, 1), 0, 0);
  EXPECT_EQ(o.error, "");
  EXPECT_LT(o.scatter, 0.001);
}

}  // namespace
}  // namespace luxfield::capture
