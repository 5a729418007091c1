// From the edge of an emergency stop to a stopped stage and a dark lamp, over the real libgpiod.
#include "hal/safety_guard.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <future>

#include "hal/gpiod/line_selector.h"
#include "hal/gpiod/safety_inputs.h"
#include "tests/gpiod/fake_gpio_chip.h"

namespace luxfield::hal {
namespace {

using gpiod::FakeGpioChip;
using testing::HasSubstr;
using TimePoint = std::chrono::steady_clock::time_point;

// A stage that notes when it is told to stop.
class ToldStage : public Stage {
 public:
  std::string identity() const override { return "told stage"; }
  StageLimits limits() const override { return {}; }
  void Home(double) override {}
  void MoveTo(Vec2, double) override {}
  StagePosition Where() override { return {}; }
  void Stop() override {
    if (broken)
      throw HardwareError(Fault::kDisconnected, identity(), "stop", "does not answer", "look");
    stopped.set_value(std::chrono::steady_clock::now());
  }

  bool broken = false;
  std::promise<TimePoint> stopped;
};

struct Rig {
  FakeGpioChip chip{{"stop", "lamp"}};
  Devices devices;
  ToldStage* stage = nullptr;

  Rig() {
    devices.clock = std::make_shared<core::SystemClock>();
    auto told = std::make_unique<ToldStage>();
    stage = told.get();
    devices.stage = std::move(told);
    devices.supply = std::make_unique<gpiod::LampRelay>("gpiochip0", gpiod::LineSettings{"lamp"});
    gpiod::SafetyInputsOptions options;
    options.chip = "gpiochip0";
    options.emergency_stop = gpiod::LineSettings{"stop"};
    options.release_s = 0.003;
    devices.inputs = std::make_unique<gpiod::SafetyInputs>(options);
    devices.supply->SetOutput(true, 1);
  }

  // Returns when the lamp is dark.
  TimePoint AwaitDark() {
    if (!chip.AwaitPin("lamp", false)) throw std::runtime_error("the lamp stays on");
    return std::chrono::steady_clock::now();
  }
};

// Looks every millisecond: spinning would take the processor from the threads that are timed.
void AwaitSafe(Inputs& inputs) {
  for (int look = 0; look < 10'000; ++look) {
    if (inputs.State().safe()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  FAIL() << "the inputs stay unsafe";
}

TEST(SafetyGuard, StopsTheStageThenSwitchesTheLampOff) {
  const char* asked = std::getenv("LUXFIELD_TRIALS");
  const int trials = asked ? std::atoi(asked) : 20;
  std::vector<double> stop_ms, dark_ms;
  Rig rig;
  for (int trial = 0; trial < trials; ++trial) {
    rig.stage->stopped = {};
    rig.devices.supply->SetOutput(true, 1);
    SafetyGuard guard(rig.devices);
    guard.ThrowIfUnsafe();
    const TimePoint edge = std::chrono::steady_clock::now();
    rig.chip.SetPin("stop", true);
    const TimePoint dark = rig.AwaitDark(), stopped = rig.stage->stopped.get_future().get();
    EXPECT_LE(stopped, dark);
    stop_ms.push_back(std::chrono::duration<double, std::milli>(stopped - edge).count());
    dark_ms.push_back(std::chrono::duration<double, std::milli>(dark - edge).count());
    EXPECT_THROW(guard.ThrowIfUnsafe(), HardwareError);
    rig.chip.SetPin("stop", false);
    AwaitSafe(*rig.devices.inputs);
    // Cleared inputs do not make a session go on that was stopped.
    EXPECT_THROW(guard.ThrowIfUnsafe(), HardwareError);
  }
  for (auto& [name, times] : {std::pair{"stage told to stop", &stop_ms}, {"lamp off", &dark_ms}}) {
    std::sort(times->begin(), times->end());
    fmt::print(
        "{}: median {:.2f} ms, worst {:.2f} ms after the edge ({} trials, 2 ms of them "
        "debouncing)\n",
        name, (*times)[times->size() / 2], times->back(), trials);
  }
}

TEST(SafetyGuard, AStageThatDoesNotAnswerDoesNotKeepTheLampOn) {
  Rig rig;
  rig.stage->broken = true;
  SafetyGuard guard(rig.devices);
  rig.chip.SetPin("stop", true);
  rig.AwaitDark();
  // The lamp is dark a moment before the guard has noted what failed.
  std::string what;
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (what.find("not everything") == std::string::npos &&
         std::chrono::steady_clock::now() < limit) {
    try {
      guard.ThrowIfUnsafe();
    } catch (const HardwareError& error) {
      EXPECT_EQ(error.fault, Fault::kStopped);
      EXPECT_TRUE(error.position_lost);
      what = error.what();
    }
  }
  EXPECT_THAT(what, HasSubstr("the emergency stop is active"));
  EXPECT_THAT(what,
              HasSubstr("not everything could be stopped: told stage: stop: does not answer"));
}

TEST(SafetyGuard, WithoutInputsEverythingIsAllowed) {
  Devices devices;
  SafetyGuard guard(devices);
  EXPECT_NO_THROW(guard.ThrowIfUnsafe());
}

}  // namespace
}  // namespace luxfield::hal
