// What is refused before the first exposure counts; that nothing is refused otherwise the other
// tests of captures show.
#include "luxfield/capture/take/preflight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "luxfield/capture/take/take_session.h"
#include "luxfield/core/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "luxfield/session/session_store.h"
#include "tests/capture/capture_fixture.h"
#include "tests/said.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::sim::SimulatedLab;
using testing::HasSubstr;

// A rig's clock whose wall clock says something else.
class OtherClock : public core::Clock {
 public:
  using Utc = std::function<std::string(double monotonic_s)>;
  OtherClock(std::shared_ptr<core::Clock> clock, Utc utc)
      : clock_(std::move(clock)), utc_(std::move(utc)) {}
  double MonotonicSeconds() override { return clock_->MonotonicSeconds(); }
  std::string UtcIso8601() override { return utc_(MonotonicSeconds()); }
  void SleepSeconds(double seconds) override { clock_->SleepSeconds(seconds); }

 private:
  std::shared_ptr<core::Clock> clock_;
  Utc utc_;
};

Devices With(OtherClock::Utc utc) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.clock = std::make_shared<OtherClock>(devices.clock, std::move(utc));
  return devices;
}

// Inputs that say one thing.
class FixedInputs : public hal::Inputs {
 public:
  explicit FixedInputs(hal::InputState state, bool real_time = true)
      : state_(std::move(state)), real_time_(real_time) {}
  std::string identity() const override { return "safety inputs"; }
  hal::InputState State() override { return state_; }
  void OnTrip(Action) override {}
  bool real_time() const override { return real_time_; }

 private:
  hal::InputState state_;
  bool real_time_;
};

std::string RefusalOf(Devices& devices) {
  Plan plan = TestPlan();
  plan.exposure.flicker = 0.005;
  try {
    RunCapture(plan, devices, NewFolder("preflight"));
  } catch (const DeviceError& error) {
    return error.what();
  }
  return {};
}

// Of the session's first epoch.
std::string RecordedInputs(const std::filesystem::path& folder) {
  const session::SessionReader session(folder);
  for (const auto& line : session.journal())
    if (line.at("type") == "epoch_start") return line.at("devices").at("inputs");
  return "no epoch";
}

class Preflight : public Capture {};

TEST_F(Preflight, ALabInOrderIsNotRefused) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_EQ(RefusalOf(devices), "");
}

TEST_F(Preflight, AWrongBlackLevelIsNamed) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.rig.camera.black_dn = 160;  // it is 100
  EXPECT_THAT(RefusalOf(devices),
              testing::AllOf(HasSubstr("the dark level is 100"), HasSubstr("says 160.0")));
}

TEST_F(Preflight, ALightLeakIsNamed) {
  hal::sim::TestLab bright = Noisy();
  bright.lamp = "kind = \"square\"\nside_m = 0.06\ndepth_m = 0.03\nradiance = 100000";
  Devices devices = SimulatedLab(bright.Config()).MakeDevices();
  devices.shutter = nullptr;  // so that darks are lit
  EXPECT_THAT(RefusalOf(devices), HasSubstr("keep light out"));
}

TEST_F(Preflight, ALensCapIsNoticed) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.shutter->Select("closed", HUGE_VAL);
  devices.shutter = nullptr;  // nobody opens it
  EXPECT_THAT(RefusalOf(devices), HasSubstr("take the lens cap off"));
}

TEST_F(Preflight, UnsafeInputsAreNamed) {
  hal::InputState pressed, open;
  pressed.emergency_stop = true;
  open.door_open = true;
  for (const auto& [state, name] :
       {std::pair{pressed, "emergency stop"}, std::pair{open, "door"}}) {
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    devices.inputs = std::make_unique<FixedInputs>(state);
    EXPECT_THAT(RefusalOf(devices), HasSubstr(name));
  }
}

TEST_F(Preflight, InputsThatOtherProgramsMayDelayAreToldAndRecorded) {
  for (const bool real_time : {true, false}) {
    Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
    devices.inputs = std::make_unique<FixedInputs>(hal::InputState(), real_time);
    const auto folder = NewFolder("priority");
    const std::string said = Said([&] { RunCapture(TestPlan(), devices, folder); });
    const std::string recorded = RecordedInputs(folder);
    if (real_time) {
      EXPECT_EQ(said, "");
      EXPECT_EQ(recorded, "safety inputs");
    } else {
      EXPECT_THAT(said, HasSubstr("safety inputs: the system refuses real-time priority"));
      EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
      EXPECT_EQ(recorded, "safety inputs, without real-time priority");
    }
  }
}

TEST_F(Preflight, ADiskThatCannotHoldASessionIsRefused) {
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  const auto free = std::filesystem::space(testing::TempDir()).available;
  EXPECT_NO_THROW(CheckDiskAndSafety(free / 4, devices, NewFolder("space")));
  EXPECT_THROW(CheckDiskAndSafety(free, devices, NewFolder("space")), DeviceError)
      << "as much as is free is less than 1.3 times as much";
}

// Whatever lies between them, a byte or a disk.
TEST(FreeAndNeededTest, TheSecondNumberIsTheLargerOne) {
  constexpr std::uint64_t kMib = 1 << 20;
  EXPECT_EQ(FreeAndNeeded(3 * kMib + 1, 3 * kMib + 2),
            "3 MiB are free, the capture may need 4 MiB");
  EXPECT_EQ(FreeAndNeeded(3 * kMib - 1, 3 * kMib), "2 MiB are free, the capture may need 3 MiB");
  EXPECT_EQ(FreeAndNeeded(0, 1), "0 MiB are free, the capture may need 1 MiB");
  EXPECT_EQ(FreeAndNeeded(3 * kMib, 70 * kMib), "3 MiB are free, the capture may need 70 MiB");
}

// What is committed is there already: the disk has to take the rest.
TEST_F(Preflight, AResumedSessionAsksForTheRoomThatItStillNeeds) {
  const auto folder = NewFolder("rest");
  CaptureOptions options;
  options.on_frame = [](const CaptureSummary& s) {
    if (s.positions == 2) core::SetInterruptCountForTest(2);
  };
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_THROW(RunCapture(TestPlan(), first, folder, options), Interrupted);
  core::SetInterruptCountForTest(0);
  std::uint64_t kept = 0;
  std::filesystem::path one;
  const session::SessionReader session(folder);
  for (const auto& frame : session.frames())
    if (frame.kind == session::FrameKind::kPosition)
      kept += std::filesystem::file_size(one = folder / frame.file);
  ASSERT_GT(kept, 0u);
  EXPECT_EQ(BytesToCome(kept + 1000, folder), 1000u);
  EXPECT_EQ(BytesToCome(kept - 1, folder), 0u);

  // A plan twice as large as the disk, of which one frame (a hole) is the most.
  const std::uint64_t whole = 2 * std::filesystem::space(folder).available;
  std::filesystem::resize_file(one, whole);
  options = {};
  options.resume = true;
  const std::vector<double> ladder_s = {0.01};
  const SessionToTake what{core::ReadJson(folder / "plan.json"), whole, ladder_s};
  Devices second = SimulatedLab(Noisy().Config()).MakeDevices();
  bool taken = false;
  TakeSession(what, second, folder, options,
              [&](session::SessionWriter&, FrameTaker&, CaptureSummary&) { taken = true; });
  EXPECT_TRUE(taken);
  std::filesystem::remove_all(folder);
}

TEST_F(Preflight, AClockThatNobodySetIsRefused) {
  Devices devices = With([](double) { return "1970-01-01T00:03:20.000Z"; });
  EXPECT_THAT(RefusalOf(devices), HasSubstr("1970-01-01"));
}

TEST_F(Preflight, AClockThatJumpsIsJournalledOnce) {
  const auto folder = NewFolder("jump");
  Devices devices = With([](double t) {  // an hour on at 20 s
    const int s = static_cast<int>(t);
    return fmt::format("2026-11-21T{:02}:{:02}:{:02}.000Z", t < 20 ? 12 : 13, s / 60, s % 60);
  });
  RunCapture(TestPlan(), devices, folder);
  const auto jumps = RecordsOf(folder, "clock_jump");
  ASSERT_EQ(jumps.size(), 1u);
  EXPECT_NEAR(jumps[0]["by_s"].get<double>(), 3600, 1);
}

TEST_F(Preflight, TheClocksOffsetIsInSeconds) {
  core::SimulatedClock clock;
  clock.SleepSeconds(123.5);
  EXPECT_NEAR(ClockOffset(clock), 946684800, 1e-3);
}

}  // namespace
}  // namespace luxfield::capture
