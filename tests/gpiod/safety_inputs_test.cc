#include "luxfield/hal/drivers/gpiod/safety_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "luxfield/hal/error.h"
#include "tests/gpiod/fake_gpio_chip.h"
#include "tests/hal/fewer_rights.h"

namespace luxfield::hal::gpiod {
namespace {

using testing::HasSubstr;

// Collects trips, and waits for them.
class Trips {
 public:
  Inputs::Action action() {
    return [this](const InputState& state) {
      const std::lock_guard lock(mutex_);
      states_.push_back(state);
      changed_.notify_all();
    };
  }
  // Whether there are `count` before `limit_s` has passed.
  bool Await(std::size_t count, double limit_s = 5) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(limit_s),
                             [&] { return states_.size() >= count; });
  }
  std::vector<InputState> states() {
    const std::lock_guard lock(mutex_);
    return states_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<InputState> states_;
};

class GpioSafety : public testing::Test {
 protected:
  SafetyInputsOptions Options() const {
    SafetyInputsOptions options;
    options.chip = "gpiochip0";
    options.emergency_stop = LineSettings{"stop"};
    options.door = LineSettings{"door"};
    options.limit = LineSettings{"limit"};
    return options;
  }
  // The debounced state turns safe, by looks of the inputs' own thread.
  bool AwaitSafe(Inputs& inputs) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (std::chrono::steady_clock::now() < end) {
      if (inputs.State().safe()) return true;
      std::this_thread::yield();
    }
    return false;
  }

  FakeGpioChip chip_{{"stop", "door", "limit"}};
};

TEST_F(GpioSafety, SafeWhileContactsAreClosed) {
  SafetyInputs inputs(Options());
  EXPECT_TRUE(inputs.State().safe());
  EXPECT_EQ(Describe(inputs.State()), "");
  EXPECT_THAT(inputs.identity(), HasSubstr("/dev/gpiochip0"));
}

TEST_F(GpioSafety, KnowsWhetherTheSystemRefusesRealTimePriority) {
  EXPECT_EQ(SafetyInputs(Options()).real_time(), GrantsRealTime());
  const NoRealTime refused;
  EXPECT_FALSE(SafetyInputs(Options()).real_time());
}

TEST_F(GpioSafety, AnOpenContactTripsOnceAndTripsAgainAfterItWasClosed) {
  SafetyInputs inputs(Options());
  Trips trips;
  inputs.OnTrip(trips.action());
  chip_.SetPin("stop", true);
  ASSERT_TRUE(trips.Await(1));
  EXPECT_TRUE(trips.states()[0].emergency_stop);
  EXPECT_FALSE(trips.states()[0].door_open);
  EXPECT_EQ(Describe(inputs.State()), "the emergency stop is active");
  chip_.SetPin("stop", false);
  ASSERT_TRUE(AwaitSafe(inputs));
  chip_.SetPin("door", true);
  ASSERT_TRUE(trips.Await(2));
  EXPECT_TRUE(trips.states()[1].door_open);
  EXPECT_EQ(trips.states().size(), 2u);
}

TEST_F(GpioSafety, UnsafeAtTheBeginningIsToldAtOnce) {
  chip_.SetPin("limit", true);
  SafetyInputs inputs(Options());
  EXPECT_TRUE(inputs.State().limit);
  Trips trips;
  inputs.OnTrip(trips.action());
  ASSERT_EQ(trips.states().size(), 1u);
  EXPECT_TRUE(trips.states()[0].limit);
}

TEST_F(GpioSafety, BouncingContactsTripOnce) {
  SafetyInputs inputs(Options());
  Trips trips;
  inputs.OnTrip(trips.action());
  for (int k = 0; k < 101; ++k) chip_.SetPin("stop", k % 2 == 0);  // ends open
  ASSERT_TRUE(trips.Await(1));
  EXPECT_TRUE(inputs.State().emergency_stop);
  EXPECT_EQ(trips.states().size(), 1u);
}

TEST_F(GpioSafety, InputsThatCannotBeReadAreUnsafe) {
  SafetyInputs inputs(Options());
  Trips trips;
  inputs.OnTrip(trips.action());
  chip_.FailReads(ENODEV);
  ASSERT_TRUE(trips.Await(1));
  EXPECT_FALSE(inputs.State().safe());
  EXPECT_THAT(Describe(inputs.State()), HasSubstr("cannot be read"));
}

TEST_F(GpioSafety, NoCallAfterTheActionIsTakenAway) {
  SafetyInputs inputs(Options());
  Trips trips;
  inputs.OnTrip(trips.action());
  inputs.OnTrip({});
  chip_.SetPin("stop", true);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (inputs.State().safe() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_FALSE(inputs.State().safe());
  EXPECT_TRUE(trips.states().empty());
}

}  // namespace
}  // namespace luxfield::hal::gpiod
