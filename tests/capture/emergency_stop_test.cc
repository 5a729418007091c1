// What a trip of the safety inputs does to a capture, whatever it is doing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>

#include "luxfield/hal/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::sim::SimulatedLab;
using testing::HasSubstr;

// Safety inputs that a test presses.
class PressedInputs : public hal::Inputs {
 public:
  std::string identity() const override { return "test inputs"; }
  hal::InputState State() override { return state_; }
  void OnTrip(Action action) override { action_ = std::move(action); }
  void Press(bool pressed) {
    const bool trips = pressed && state_.safe();
    state_.emergency_stop = pressed;
    if (trips && action_) action_(state_);
  }

 private:
  hal::InputState state_;
  Action action_;
};

TEST_F(Capture, AnEmergencyStopEndsInADarkLampAndASessionThatCanBeResumed) {
  const auto folder = NewFolder("stopped");
  Plan plan = TestPlan();
  plan.exposure.repeats = 3;
  Devices first = SimulatedLab(Noisy().Config()).MakeDevices();
  auto owned = std::make_unique<PressedInputs>();
  PressedInputs& inputs = *owned;
  first.inputs = std::move(owned);
  CaptureOptions options;
  // Pressed within a bracket and released at once: the session has stopped all the same.
  options.on_frame = [&](const CaptureSummary& s) {
    if (s.positions != 2) return;
    inputs.Press(true);
    EXPECT_FALSE(first.supply->State().output);
    inputs.Press(false);
  };
  try {
    RunCapture(plan, first, folder, options);
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kStopped);
    EXPECT_THAT(error.what(), HasSubstr("the emergency stop is active"));
  }
  const auto pauses = RecordsOf(folder, "paused");
  ASSERT_EQ(pauses.size(), 1u);
  EXPECT_THAT(pauses[0]["reason"].get<std::string>(), HasSubstr("emergency stop"));
  options = {};
  options.resume = true;
  Devices second = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_EQ(RunCapture(plan, second, folder, options).positions, 4);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

// A lamp supply that lets a test act before it obeys.
class WatchedSupply : public hal::Supply {
 public:
  WatchedSupply(
      std::unique_ptr<hal::Supply> supply, std::function<void(bool on)> before,
      std::function<void()> before_reading = [] {})
      : supply_(std::move(supply)),
        before_(std::move(before)),
        before_reading_(std::move(before_reading)) {}
  std::string identity() const override { return supply_->identity(); }
  hal::SupplyState SetOutput(bool on, double deadline_s) override {
    before_(on);
    return supply_->SetOutput(on, deadline_s);
  }
  hal::SupplyState State() override {
    before_reading_();
    return supply_->State();
  }

 private:
  std::unique_ptr<hal::Supply> supply_;
  std::function<void(bool on)> before_;
  std::function<void()> before_reading_;
};

// A monitor that lets a test act before each reading.
class WatchedMonitor : public hal::Meter {
 public:
  WatchedMonitor(std::unique_ptr<hal::Meter> meter, std::function<void()> before)
      : meter_(std::move(meter)), before_(std::move(before)) {}
  std::string identity() const override { return meter_->identity(); }
  hal::Reading Read(double deadline_s) override {
    before_();
    return meter_->Read(deadline_s);
  }

 private:
  std::unique_ptr<hal::Meter> meter_;
  std::function<void()> before_;
};

TEST_F(Capture, AnEmergencyStopWhileTheLampIsSwitchedOnLeavesItOff) {
  const auto folder = NewFolder("lit");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto inputs = std::make_unique<PressedInputs>();
  // The worst moment: the guard has switched the lamp off before the order to switch it on goes
  // out.
  devices.supply =
      std::make_unique<WatchedSupply>(std::move(devices.supply), [pressed = inputs.get()](bool on) {
        if (on) pressed->Press(true);
      });
  devices.inputs = std::move(inputs);
  try {
    RunCapture(TestPlan(), devices, folder);
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kStopped) << error.what();
  }
  EXPECT_FALSE(devices.supply->State().output);
  EXPECT_EQ(RecordsOf(folder, "paused").size(), 1u);
}

// The supply is switched off at once, and whoever waits for its measurement gives way.
TEST_F(Capture, AnEmergencyStopWhileTheSupplyIsAskedIsToldAsOne) {
  const auto folder = NewFolder("asked");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto inputs = std::make_unique<PressedInputs>();
  devices.supply = std::make_unique<WatchedSupply>(
      std::move(devices.supply), [](bool) {},
      [pressed = inputs.get()] {
        if (!pressed->State().safe()) return;
        pressed->Press(true);
        throw hal::HardwareError(hal::Fault::kStopped, "supply", "read", "gave way", "look why");
      });
  devices.inputs = std::move(inputs);
  try {
    RunCapture(TestPlan(), devices, folder);
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kStopped);
    EXPECT_THAT(error.what(), HasSubstr("the emergency stop is active"));
  }
  EXPECT_FALSE(devices.supply->State().output);
  EXPECT_EQ(RecordsOf(folder, "paused").size(), 1u);
}

TEST_F(Capture, AnEmergencyStopDuringWarmUpIsToldAsOne) {
  const auto folder = NewFolder("warm");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto inputs = std::make_unique<PressedInputs>();
  int readings = 0;
  devices.monitor = std::make_unique<WatchedMonitor>(std::move(devices.monitor),
                                                     [pressed = inputs.get(), &readings] {
                                                       if (++readings == 3) pressed->Press(true);
                                                     });
  devices.inputs = std::move(inputs);
  try {
    RunCapture(TestPlan(), devices, folder);
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kStopped) << error.what();
  }
  EXPECT_FALSE(devices.supply->State().output);
  EXPECT_EQ(RecordsOf(folder, "paused").size(), 1u);
}

// A stage that lets a test act as a move begins.
class WatchedStage : public hal::Stage {
 public:
  WatchedStage(std::unique_ptr<hal::Stage> stage, std::function<void()> before)
      : stage_(std::move(stage)), before_(std::move(before)) {}
  std::string identity() const override { return stage_->identity(); }
  hal::StageLimits limits() const override { return stage_->limits(); }
  void Home(double deadline_s) override { stage_->Home(deadline_s); }
  void MoveTo(hal::Vec2 centre, double deadline_s) override {
    before_();
    stage_->MoveTo(centre, deadline_s);
  }
  hal::StagePosition Where() override { return stage_->Where(); }
  void Stop() override { stage_->Stop(); }

 private:
  std::unique_ptr<hal::Stage> stage_;
  std::function<void()> before_;
};

// The stage ends its move on the stop; the session has to say what stopped it.
TEST_F(Capture, AnEmergencyStopInAMoveIsToldAsOne) {
  const auto folder = NewFolder("moving");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto inputs = std::make_unique<PressedInputs>();
  int moves = 0;
  devices.stage =
      std::make_unique<WatchedStage>(std::move(devices.stage), [pressed = inputs.get(), &moves] {
        if (++moves == 3) pressed->Press(true);
      });
  devices.inputs = std::move(inputs);
  try {
    RunCapture(TestPlan(), devices, folder);
    FAIL();
  } catch (const hal::HardwareError& error) {
    EXPECT_EQ(error.fault, hal::Fault::kStopped);
    EXPECT_THAT(error.what(), HasSubstr("the emergency stop is active"));
  }
  EXPECT_EQ(moves, 3);
  EXPECT_FALSE(devices.supply->State().output);
  EXPECT_EQ(RecordsOf(folder, "paused").size(), 1u);
}

TEST_F(Capture, NothingBeginsWhileTheEmergencyStopIsActive) {
  const auto folder = NewFolder("pressed");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto inputs = std::make_unique<PressedInputs>();
  inputs->Press(true);
  devices.inputs = std::move(inputs);
  EXPECT_THROW(RunCapture(TestPlan(), devices, folder), DeviceError);
  EXPECT_FALSE(devices.supply->State().output);
  EXPECT_FALSE(devices.stage->Where().homed);
}

}  // namespace
}  // namespace luxfield::capture
