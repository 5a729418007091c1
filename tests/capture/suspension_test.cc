// Suspension where the lamp drifts out of the plan's band.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using core::Json;
using hal::Devices;
using hal::sim::SimulatedLab;
using hal::sim::TestLab;
using testing::HasSubstr;

constexpr double kBand = 0.03;

// At its brightest when the first reference is taken, out of the band ten seconds later, and back
// within half of it after 50 s. A position takes two seconds.
TestLab Wandering() {
  TestLab lab = Noisy();
  lab.errors += "[errors.drift]\nper_hour = 0\namplitude = 0.05\nperiod_s = 60\n";
  return lab;
}

Plan Watchful() {
  Plan plan = TestPlan();
  plan.reference = {.every = 3, .max_drift = kBand, .resume_share = 0.5, .interval_s = 5};
  plan.warm_up.variation = 0.1;
  return plan;
}

// Of position frames, the monitor's largest deviation from its reading at the first reference.
double LargestDeviation(const std::vector<session::FrameRecord>& frames) {
  double first = 0, largest = 0;
  for (const auto& r : frames)
    if (r.kind == session::FrameKind::kReference && first == 0) first = r.meter;
  for (const auto& r : frames)
    if (r.kind == session::FrameKind::kPosition)
      largest = std::max(largest, std::abs(r.meter / first - 1));
  return largest;
}

double OffBy(const Json& record) { return std::abs(record["ratio"].get<double>() - 1); }

class Suspension : public Capture {};

TEST_F(Suspension, WaitsForTheNarrowerBandAndTakesTheDoubtfulAgain) {
  const auto folder = NewFolder("suspended");
  Devices devices = SimulatedLab(Wandering().Config()).MakeDevices();
  const CaptureSummary summary = RunCapture(Watchful(), devices, folder);
  EXPECT_EQ(summary.positions, 6);
  EXPECT_GE(summary.suspensions, 1);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());

  const auto suspended = RecordsOf(folder, "suspended"), resumed = RecordsOf(folder, "resumed");
  ASSERT_EQ(suspended.size(), static_cast<std::size_t>(summary.suspensions));
  ASSERT_EQ(resumed.size(), suspended.size());
  EXPECT_EQ(RecordsOf(folder, "epoch_start").size(), 1 + suspended.size());
  std::size_t retaken = 0;
  for (const Json& record : suspended) {
    EXPECT_GT(OffBy(record), kBand);
    retaken += record["retake"].size();
  }
  EXPECT_GE(retaken, 1u);
  EXPECT_EQ(RecordsOf(folder, "position_complete").size(), 6 + retaken);
  for (const Json& record : RecordsOf(folder, "reference")) EXPECT_LE(OffBy(record), kBand);

  // Hysteresis: every look but the last of a suspension is outside the narrower band.
  const session::SessionReader reader(folder);
  const Json* last = nullptr;
  for (const Json& record : reader.journal()) {
    if (record["type"] == "resumed") {
      ASSERT_NE(last, nullptr);
      EXPECT_LE(OffBy(*last), 0.5 * kBand);
      last = nullptr;
    }
    if (record["type"] != "drift") continue;
    if (last) {
      EXPECT_GT(OffBy(*last), 0.5 * kBand);
    }
    last = &record;
  }

  // What counts was taken inside the band; without taking it again it would not have been.
  std::vector<session::FrameRecord> all;
  for (const Json& record : RecordsOf(folder, "frame")) {
    session::FrameRecord r;
    r.kind = record["kind"] == "position"    ? session::FrameKind::kPosition
             : record["kind"] == "reference" ? session::FrameKind::kReference
                                             : session::FrameKind::kDark;
    r.meter = record["meter"];
    all.push_back(r);
  }
  EXPECT_LE(LargestDeviation(reader.frames()), kBand);
  EXPECT_GT(LargestDeviation(all), kBand);
}

TEST_F(Suspension, ASteadyLampIsNeverSuspended) {
  const auto folder = NewFolder("steady");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_EQ(RunCapture(Watchful(), devices, folder).suspensions, 0);
  EXPECT_THAT(RecordsOf(folder, "suspended"), testing::IsEmpty());
  EXPECT_EQ(RecordsOf(folder, "epoch_start").size(), 1u);
}

TEST_F(Suspension, EndsAfterTheLongestWaitAndCanBeResumed) {
  const auto folder = NewFolder("drift");
  const TestLab lab = Wandering();
  Plan plan = Watchful();
  plan.reference.max_wait_s = 20;
  plan.reference.every = 6;
  Devices devices = SimulatedLab(lab.Config()).MakeDevices();
  try {
    RunCapture(plan, devices, folder);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("of its first reference after 2"),
                                             HasSubstr("--accept-drift")));
  }
  const double waited = RecordsOf(folder, "paused").at(0)["t_s"].get<double>() -
                        RecordsOf(folder, "suspended").at(0)["t_s"].get<double>();
  EXPECT_GE(waited, 20);
  EXPECT_LE(waited, 20 + 5 + 5);  // an interval and a frame more
  CaptureOptions options;
  options.resume = options.accept_drift = true;
  Devices again = SimulatedLab(lab.Config()).MakeDevices();
  const CaptureSummary summary = RunCapture(plan, again, folder, options);
  EXPECT_GT(summary.lamp_ratio_max - summary.lamp_ratio_min, kBand);
  EXPECT_EQ(summary.positions, 6) << "no two good references stand about any of them";
  EXPECT_EQ(summary.suspensions, 0);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

TEST_F(Suspension, CtrlCEndsTheWaitAndResumeTakesTheDoubtfulAgain) {
  const auto folder = NewFolder("interrupted");
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.lamp_ratio_min < 1 - kBand) core::SetInterruptCountForTest(1);
  };
  Devices devices = SimulatedLab(Wandering().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(Watchful(), devices, folder, options), Interrupted);
  EXPECT_THAT(RecordsOf(folder, "drift"), testing::IsEmpty());
  const auto retake = RecordsOf(folder, "suspended").at(0)["retake"];
  ASSERT_FALSE(retake.empty());
  const std::size_t complete = RecordsOf(folder, "position_complete").size();
  core::SetInterruptCountForTest(0);
  options = {};
  options.resume = true;
  Devices again = SimulatedLab(Wandering().Config()).MakeDevices();
  const CaptureSummary rest = RunCapture(Watchful(), again, folder, options);
  EXPECT_EQ(rest.positions, 6 - static_cast<int>(complete - retake.size()));
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

// A run that dies between two references leaves positions that only the next one can vouch for.
TEST_F(Suspension, ADriftFoundOnResumeDiscardsWhatNoReferenceFollowed) {
  const auto folder = NewFolder("unconfirmed");
  Plan plan = Watchful();
  plan.reference.every = 2;
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.positions == 3) core::SetInterruptCountForTest(1);
  };
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(plan, first, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  options = {};
  options.resume = true;
  TestLab bright = Noisy();  // above the first run's lamp, settling
  bright.errors += "[errors.warm_up]\nexcess = 0.06\ntau_s = 60\n";
  Devices second = SimulatedLab(bright.Config()).MakeDevices();
  RunCapture(plan, second, folder, options);
  const auto suspended = RecordsOf(folder, "suspended");
  ASSERT_EQ(suspended.size(), 1u);
  EXPECT_EQ(suspended[0]["retake"].size(), 2u) << "of four, those after the second reference";
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

}  // namespace
}  // namespace luxfield::capture
