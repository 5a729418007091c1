#include "luxfield/capture/lamp/flicker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"
#include "tests/capture/faulty_camera.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

rig::SensorModel Camera() {
  rig::SensorModel c;
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

// What ends the capture, and what its journal says.
struct Outcome {
  std::string error;
  double scatter = 0, exposure_s = 0, hz = 0, sigma_hz = 0;
};
Outcome CaptureOf(const TestLab& lab, double lab_states_hz, double plan_states_hz,
                  double longest_s = 3) {
  const auto folder = NewFolder("flicker");
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  devices.rig.pwm_hz = lab_states_hz;
  Plan plan = TestPlan();
  plan.exposure.pwm_hz = plan_states_hz;
  plan.exposure.max_s = longest_s;
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
  outcome.hz = records.at(0).value("hz", 0.0);
  outcome.sigma_hz = records.at(0).value("sigma_hz", 0.0);
  return outcome;
}

class FlickerCapture : public Capture {};

TEST_F(FlickerCapture, AnUnstatedPulseIsFoundAndMeasured) {
  for (const auto& [hz, duty] : {std::pair{61.3, 0.3}, {97.0, 0.6}, {203.7, 0.05}}) {
    const Outcome o = CaptureOf(Pulsing(hz, duty), 0, 0);
    EXPECT_THAT(o.error, testing::AllOf(HasSubstr("the lamp flickers"), HasSubstr("it pulses at "),
                                        HasSubstr("state it as exposure.pwm_hz")));
    const double expected = RmsOfPulses(hz * o.exposure_s, duty);
    EXPECT_NEAR(o.scatter, expected, expected * 4 * 0.5 * std::sqrt(3.0 / 23))
        << hz << " Hz, duty " << duty << ", " << o.exposure_s << " s";
    EXPECT_NEAR(o.hz, hz, 5 * o.sigma_hz);
    EXPECT_LT(o.sigma_hz, 1e-3 * hz);
  }
}

TEST_F(FlickerCapture, AWrongFrequencyIsRefusedWithTheMeasuredOneAndTheRightOneIsNot) {
  for (const auto& [lab_hz, plan_hz] : {std::pair{0.0, 57.0}, {57.0, 0.0}})
    EXPECT_THAT(CaptureOf(Pulsing(61.3, 0.3), lab_hz, plan_hz).error,
                HasSubstr("pwm_hz = 57, but the lamp pulses at 61."));
  // Twice it is the multiple of a half: exposures may be of whole odd halves.
  EXPECT_THAT(CaptureOf(Pulsing(61.3, 0.3), 0, 122.6).error, HasSubstr("but the lamp pulses at"));
  for (const double stated_hz : {61.3, 30.65})
    for (const bool by_plan : {false, true}) {
      const Outcome o =
          CaptureOf(Pulsing(61.3, 0.3), by_plan ? 0 : stated_hz, by_plan ? stated_hz : 0);
      EXPECT_EQ(o.error, "");
      EXPECT_LT(o.scatter, 0.001);
      EXPECT_NEAR(o.hz, 61.3, 5 * o.sigma_hz);
    }
}

TEST_F(FlickerCapture, ALampThatIsAlwaysOnDoesNotFlicker) {
  const Outcome o = CaptureOf(Pulsing(61.3, 1), 0, 0);
  EXPECT_EQ(o.error, "");
  EXPECT_LT(o.scatter, 0.001);
}

// Close to whole periods frames scatter by (df / f) sqrt((1 - D) / D), however many they are.
TEST_F(FlickerCapture, ExposuresNextToWholePeriodsScatterByTheFrequencysError) {
  for (const auto& [hz, duty] : {std::pair{61.3, 0.3}, {97.0, 0.2}}) {
    constexpr double kOff = 0.01;
    const Outcome o = CaptureOf(Pulsing(hz, duty), 0, hz * (1 + kOff), 0.04);
    EXPECT_THAT(o.error, HasSubstr("but the lamp pulses at"));
    const double expected = kOff * std::sqrt((1 - duty) / duty);
    EXPECT_NEAR(RmsOfPulses(hz * o.exposure_s, duty), expected, 0.15 * expected);
    EXPECT_NEAR(o.scatter, expected, expected * 4 * 0.5 * std::sqrt(3.0 / 23));
  }
}

Plan MeasuringPlan() {
  Plan plan = TestPlan();
  plan.exposure.measure_pwm = true;
  plan.exposure.flicker = 0.002;
  return plan;
}

std::vector<double> LadderOf(const std::filesystem::path& folder) {
  return session::SessionReader(folder).plan().at("exposure").at("ladder_s");
}

void ExpectWholePeriods(const std::vector<double>& ladder_s, double hz, double within) {
  for (const double exposure_s : ladder_s) {
    const double periods = exposure_s * hz;
    EXPECT_GE(periods, 1 - within);
    EXPECT_NEAR(periods / std::round(periods), 1, within) << exposure_s << " s at " << hz << " Hz";
  }
}

// Lamps at random: the exposures of the session are whole periods, and its frames scatter as the
// error of the measured frequency lets them: at random phases by (df / f) sqrt((1 - D) / D).
// LUXFIELD_LAMPS asks for more lamps.
TEST_F(FlickerCapture, ExposuresBecomeWholePeriodsOfTheMeasuredFrequency) {
  const char* asked = std::getenv("LUXFIELD_LAMPS");
  const int lamps = asked ? std::atoi(asked) : 3;
  for (int lamp = 0; lamp < lamps; ++lamp) {
    core::Random random(77, static_cast<std::uint64_t>(lamp));
    const double hz = 50 * std::pow(20, random.Uniform()), duty = 0.1 + 0.8 * random.Uniform();
    SCOPED_TRACE(fmt::format("lamp {}: {} Hz, duty {}", lamp, hz, duty));
    const auto folder = NewFolder("measured");
    TestLab lab = Pulsing(hz, duty);  // bright: in the dim one noise hides the shortest ripples
    lab.lamp = "kind = \"square\"\nside_m = 0.06\ndepth_m = 0.03\nradiance = 20000";
    Devices devices = SimulatedLab(lab.Config()).MakeDevices();
    devices.rig.pwm_hz = 333;  // measured all the same
    const CaptureSummary summary = RunCapture(MeasuringPlan(), devices, folder);
    EXPECT_EQ(summary.positions, 6);
    const auto records = RecordsOf(folder, "flicker");
    ASSERT_EQ(records.size(), 1u);
    ASSERT_TRUE(records[0].contains("sigma_hz")) << records[0].dump();
    const double planned_hz = session::SessionReader(folder).plan().at("exposure").at("pwm_hz");
    const double stated_hz = records[0]["stated_hz"], found_hz = records[0]["hz"];
    const double sigma_hz = records[0]["sigma_hz"], scatter = records[0]["scatter"];
    EXPECT_EQ(stated_hz, planned_hz);
    EXPECT_NEAR(found_hz, hz, 5 * sigma_hz);
    EXPECT_NEAR(planned_hz, hz, 8 * sigma_hz);
    ExpectWholePeriods(LadderOf(folder), hz, 8 * sigma_hz / hz);
    const double ripple = std::abs(planned_hz / hz - 1) * std::sqrt((1 - duty) / duty);
    const double noise = records[0]["noise"], s2 = noise * noise + ripple * ripple;
    EXPECT_LT(scatter * scatter, s2 * (1 + 5 * std::sqrt(3.0 / 23)) - noise * noise);
    std::filesystem::remove_all(folder);
  }
}

TEST_F(FlickerCapture, ALampWithoutPulsesKeepsTheExposuresOfThePlan) {
  const auto folder = NewFolder("steady");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  Plan plan = MeasuringPlan();
  RunCapture(plan, devices, folder);
  plan.exposure.measure_pwm = false;
  EXPECT_EQ(LadderOf(folder), ExpandPlan(plan, devices).ladder_s);
  EXPECT_EQ(session::SessionReader(folder).plan().at("exposure").at("pwm_hz"), 0.0);
}

TEST_F(FlickerCapture, AResumedSessionKeepsItsExposuresAndMeasuresAgain) {
  const auto folder = NewFolder("resumed");
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.positions == 2) core::SetInterruptCountForTest(1);
  };
  const auto capture = [&](const TestLab& lab) {
    Devices devices = SimulatedLab(lab.Config()).MakeDevices();
    RunCapture(MeasuringPlan(), devices, folder, options);
  };
  EXPECT_THROW(capture(Pulsing(317.3, 0.4)), Interrupted);
  core::SetInterruptCountForTest(0);
  const auto ladder_s = LadderOf(folder);
  ExpectWholePeriods(ladder_s, 317.3, 1e-4);
  options = {};
  EXPECT_THROW(capture(Pulsing(317.3, 0.4)), InputError) << "without --resume it is another's";
  options.resume = true;
  try {
    capture(Pulsing(322.9, 0.4));
    FAIL() << "the lamp has changed";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("pulses at 322.9"), HasSubstr("wanders")));
  }
  capture(Pulsing(317.3, 0.4));
  EXPECT_EQ(LadderOf(folder), ladder_s);
  EXPECT_EQ(RecordsOf(folder, "flicker").size(), 3u);
}

// A camera that only says when it was asked: late by up to 20 ms.
TEST_F(FlickerCapture, StartsThatAreToldTooInexactlyAreRefused) {
  const auto folder = NewFolder("inexact");
  Devices devices = SimulatedLab(Pulsing(517, 0.3).Config()).MakeDevices();
  core::Random random(3, 1);
  devices.camera = std::make_unique<FaultyCamera>(std::move(devices.camera),
                                                  [&](int, hal::Frame& frame, const hal::Frame&) {
                                                    frame.t_start_s += 0.02 * random.Uniform();
                                                  });
  Plan plan = MeasuringPlan();
  plan.exposure.min_s = 0.0043;
  try {
    RunCapture(plan, devices, folder);
    FAIL() << "takes it for steady";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(HasSubstr("its frequency cannot be told"),
                               HasSubstr("known too inexactly"), HasSubstr("state it as")));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "plan.json"));
}

TEST_F(FlickerCapture, AListOfShutterSpeedsCannotFollowAFrequency) {
  class Listed : public FaultyCamera {
   public:
    using FaultyCamera::FaultyCamera;
    hal::CameraCapabilities capabilities() const override {
      auto c = FaultyCamera::capabilities();
      c.exposures_s = {0.01, 0.04, 0.16, 0.64, 2.5};
      return c;
    }
  };
  Devices devices = SimulatedLab(Pulsing(517, 0.3).Config()).MakeDevices();
  devices.camera = std::make_unique<Listed>(std::move(devices.camera),
                                            [](int, hal::Frame&, const hal::Frame&) {});
  EXPECT_THROW(RunCapture(MeasuringPlan(), devices, NewFolder("listed")), InputError);
}

}  // namespace
}  // namespace luxfield::capture
