#include "luxfield/hal/drivers/gpiod/trigger_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <vector>

#include "luxfield/hal/error.h"
#include "tests/gpiod/fake_gpio_chip.h"
#include "tests/hal/error_of.h"

namespace luxfield::hal::gpiod {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Sees what the pin does while the driver waits.
class WatchingClock : public core::SimulatedClock {
 public:
  explicit WatchingClock(FakeGpioChip& chip) : chip_(chip) {}
  void SleepSeconds(double seconds) override {
    high.push_back(chip_.Pin("trigger"));
    slept_s += seconds;
    SimulatedClock::SleepSeconds(seconds);
  }

  std::vector<bool> high;
  double slept_s = 0;

 private:
  FakeGpioChip& chip_;
};

class TriggerLineTest : public testing::Test {
 protected:
  TriggerLine Open(bool active_low = false) {
    return {{"gpiochip0", {"trigger", active_low}, 0.002}, clock_};
  }
  double Soon() { return clock_->MonotonicSeconds() + 1; }

  FakeGpioChip chip_{{"trigger"}};
  std::shared_ptr<WatchingClock> clock_ = std::make_shared<WatchingClock>(chip_);
};

TEST_F(TriggerLineTest, APulseIsTwoEdgesAndTheTimeBetween) {
  {
    TriggerLine trigger = Open();
    EXPECT_EQ(trigger.identity(), "trigger trigger on /dev/gpiochip0");
    EXPECT_THAT(chip_.History("trigger"), ElementsAre(false));
    trigger.Pulse(Soon());
    EXPECT_THAT(chip_.History("trigger"), ElementsAre(false, true, false));
    EXPECT_THAT(clock_->high, ElementsAre(true));
    EXPECT_EQ(clock_->slept_s, 0.002);
    trigger.Pulse(Soon());
    EXPECT_THAT(chip_.History("trigger"), ElementsAre(false, true, false, true, false));
  }
  EXPECT_FALSE(chip_.Pin("trigger"));
}

TEST_F(TriggerLineTest, ActiveLowTurnsTheEdgesRound) {
  TriggerLine trigger = Open(true);
  EXPECT_THAT(chip_.History("trigger"), ElementsAre(true));
  trigger.Pulse(Soon());
  EXPECT_THAT(chip_.History("trigger"), ElementsAre(true, false, true));
}

TEST_F(TriggerLineTest, GivesNoPulseThatCouldNotEndInTime) {
  TriggerLine trigger = Open();
  const HardwareError error = ErrorOf([&] { trigger.Pulse(clock_->MonotonicSeconds() + 0.001); });
  EXPECT_EQ(error.fault, Fault::kTimeout);
  EXPECT_THAT(chip_.History("trigger"), ElementsAre(false));
}

TEST_F(TriggerLineTest, ALineThatDoesNotFollowIsRefused) {
  TriggerLine trigger = Open();
  chip_.StickPin("trigger");
  const HardwareError error = ErrorOf([&] { trigger.Pulse(Soon()); });
  EXPECT_EQ(error.fault, Fault::kRefused);
  EXPECT_THAT(error.what(), HasSubstr("does not read back as set"));
  EXPECT_THAT(chip_.History("trigger"), ElementsAre(false, true, false));
}

TEST_F(TriggerLineTest, RestsAfterAnErrorAmidThePulse) {
  TriggerLine trigger = Open();
  chip_.FailReads(EIO);
  EXPECT_THROW(trigger.Pulse(Soon()), HardwareError);
  EXPECT_THAT(chip_.History("trigger"), ElementsAre(false, true, false));
}

}  // namespace
}  // namespace luxfield::hal::gpiod
