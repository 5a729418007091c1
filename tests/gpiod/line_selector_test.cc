#include "luxfield/hal/drivers/gpiod/line_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "luxfield/hal/error.h"
#include "tests/gpiod/fake_gpio_chip.h"

namespace luxfield::hal::gpiod {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class GpioSelector : public testing::Test {
 protected:
  double Soon(double seconds) { return clock_->MonotonicSeconds() + seconds; }
  LineSelectorOptions Shutter() {
    return {"shutter", "gpiochip0", {{"closed", {}, {}}, {"open", LineSettings{"drive-a"}, {}}}, 0};
  }
  LineSelectorOptions Changer() {
    return {"filter changer",
            "gpiochip0",
            {{"plus", LineSettings{"drive-a"}, LineSettings{"at-a"}},
             {"minus", LineSettings{"drive-b"}, LineSettings{"at-b"}}},
            0};
  }
  template <typename Action>
  static Fault FaultOf(Action&& action) {
    try {
      action();
    } catch (const HardwareError& error) {
      return error.fault;
    }
    ADD_FAILURE() << "nothing was thrown";
    return Fault::kProtocol;
  }

  FakeGpioChip chip_{{"drive-a", "drive-b", "at-a", "at-b"}};
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
};

TEST_F(GpioSelector, AShutterBeginsInItsFirstPositionAndFollows) {
  LineSelector shutter(Shutter(), clock_);
  EXPECT_EQ(shutter.Current(), "closed");
  EXPECT_FALSE(chip_.Pin("drive-a"));
  shutter.Select("open", Soon(1));
  EXPECT_TRUE(chip_.Pin("drive-a"));
  EXPECT_EQ(shutter.Current(), "open");
  shutter.Select("closed", Soon(1));
  EXPECT_FALSE(chip_.Pin("drive-a"));
  EXPECT_THAT(shutter.positions(), ElementsAre("closed", "open"));
  EXPECT_EQ(FaultOf([&] { shutter.Select("ajar", Soon(1)); }), Fault::kOutOfRange);
}

TEST_F(GpioSelector, AnOutputThatDoesNotFollowIsRefused) {
  LineSelector shutter(Shutter(), clock_);
  chip_.StickPin("drive-a");
  EXPECT_EQ(FaultOf([&] { shutter.Select("open", Soon(1)); }), Fault::kRefused);
}

TEST_F(GpioSelector, AChangerWaitsForItsSensorAndSwitchesOffBeforeOn) {
  chip_.SetPin("at-a", true);
  LineSelector changer(Changer(), clock_);
  EXPECT_EQ(changer.Current(), "plus");
  // The mechanism: leaves a, arrives at b.
  std::thread mechanism([&] {
    EXPECT_TRUE(chip_.AwaitPin("drive-b", true));
    EXPECT_FALSE(chip_.Pin("drive-a"));
    chip_.SetPin("at-a", false);
    chip_.SetPin("at-b", true);
  });
  changer.Select("minus", Soon(5));
  mechanism.join();
  EXPECT_EQ(changer.Current(), "minus");
}

TEST_F(GpioSelector, AChangerThatIsStuckEndsByTheDeadline) {
  chip_.SetPin("at-a", true);
  LineSelector changer(Changer(), clock_);
  const double begin = clock_->MonotonicSeconds();
  EXPECT_EQ(FaultOf([&] { changer.Select("minus", begin + 0.15); }), Fault::kTimeout);
  EXPECT_GE(clock_->MonotonicSeconds(), begin + 0.15);
}

TEST_F(GpioSelector, ContradictingSensorsAreNoPosition) {
  chip_.SetPin("at-a", true);
  chip_.SetPin("at-b", true);
  LineSelector changer(Changer(), clock_);
  EXPECT_EQ(FaultOf([&] { changer.Current(); }), Fault::kProtocol);
}

TEST_F(GpioSelector, PositionsThatMakeNoSenseAreRefused) {
  auto options = Changer();
  options.positions[1].sensor.reset();
  try {
    LineSelector changer(options, clock_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("sensors at 1 of its 2 positions"));
  }
}

TEST_F(GpioSelector, ALampRelayIsOffWhenItIsMadeAndWhenItEnds) {
  {
    LampRelay lamp("gpiochip0", {"drive-b"});
    EXPECT_FALSE(lamp.State().output);
    EXPECT_TRUE(lamp.SetOutput(true, 0).output);
    EXPECT_TRUE(chip_.Pin("drive-b"));
    EXPECT_TRUE(std::isnan(lamp.State().voltage_v));
  }
  EXPECT_THAT(chip_.History("drive-b"), ElementsAre(false, true, false));
}

}  // namespace
}  // namespace luxfield::hal::gpiod
