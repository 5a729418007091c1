// Pausing a capture without ending it.
#include "luxfield/core/pause.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "luxfield/core/error.h"
#include "luxfield/hal/lab/open_lab.h"
#include "tests/capture/capture_fixture.h"

namespace luxfield::capture {
namespace {

using hal::Devices;
using hal::sim::SimulatedLab;

// Safety inputs that see every step of a pause, and end it after so many.
class Witness : public hal::Inputs {
 public:
  Witness(Devices& devices, int looks, std::function<void()> then)
      : devices_(devices), looks_(looks), then_(std::move(then)) {}
  std::string identity() const override { return "witness"; }
  hal::InputState State() override {
    if (!core::PauseWanted() || devices_.supply->State().output) return {};
    places.push_back(devices_.stage->Where().setpoint);
    if (static_cast<int>(places.size()) == looks_) then_();
    return {};
  }
  void OnTrip(Action) override {}

  std::vector<hal::Vec2> places;  // of the stage, the lamp off

 private:
  Devices& devices_;
  const int looks_;
  std::function<void()> then_;
};

class Pause : public Capture {
 protected:
  void TearDown() override {
    core::SetPauseWantedForTest(false);
    Capture::TearDown();
  }

  static CaptureOptions PauseAtThirdPosition() {
    CaptureOptions options;
    options.on_frame = [asked = false](const CaptureSummary& s) mutable {
      if (s.positions == 2 && !asked) core::SetPauseWantedForTest(asked = true);
    };
    return options;
  }
};

TEST_F(Pause, RestsWithTheLampOffAndGoesOnInANewEpoch) {
  const auto folder = NewFolder("pause");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  auto witness = std::make_unique<Witness>(devices, 30, [] { core::SetPauseWantedForTest(false); });
  const Witness& seen = *witness;
  devices.inputs = std::move(witness);
  const CaptureSummary summary = RunCapture(TestPlan(), devices, folder, PauseAtThirdPosition());
  EXPECT_EQ(summary.positions, 6);
  ASSERT_EQ(seen.places.size(), 30u);
  for (const hal::Vec2 place : seen.places) EXPECT_EQ(place.x, seen.places.front().x);
  const auto paused = RecordsOf(folder, "paused"), resumed = RecordsOf(folder, "resumed");
  ASSERT_EQ(paused.size(), 1u);
  ASSERT_EQ(resumed.size(), 1u);
  EXPECT_EQ(paused[0]["reason"], "asked to wait");
  EXPECT_GE(resumed[0]["waited_s"].get<double>(), 10);
  EXPECT_EQ(RecordsOf(folder, "epoch_start").size(), 2u);
  EXPECT_EQ(RecordsOf(folder, "warm_up").size(), 2u);
  EXPECT_EQ(RecordsOf(folder, "position_complete").size(), 6u) << "nothing is taken twice";
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

TEST_F(Pause, CtrlCEndsIt) {
  const auto folder = NewFolder("pause_end");
  Devices devices = SimulatedLab(Noisy().Config()).MakeDevices();
  devices.inputs = std::make_unique<Witness>(devices, 3, [] { core::SetInterruptCountForTest(1); });
  EXPECT_THROW(RunCapture(TestPlan(), devices, folder, PauseAtThirdPosition()), Interrupted);
  core::SetInterruptCountForTest(0);
  core::SetPauseWantedForTest(false);
  CaptureOptions options;
  options.resume = true;
  Devices again = SimulatedLab(Noisy().Config()).MakeDevices();
  EXPECT_EQ(RunCapture(TestPlan(), again, folder, options).positions, 3);
  EXPECT_THAT(VerifySession(folder).problems, testing::IsEmpty());
}

TEST_F(Pause, TheSignalTurnsItOnAndOff) {
  struct sigaction before {};
  sigaction(SIGTSTP, nullptr, &before);
  core::InstallPauseHandler();
  EXPECT_FALSE(core::PauseWanted());
  raise(SIGTSTP);
  EXPECT_TRUE(core::PauseWanted());
  raise(SIGTSTP);
  EXPECT_FALSE(core::PauseWanted());
  sigaction(SIGTSTP, &before, nullptr);
}

}  // namespace
}  // namespace luxfield::capture
