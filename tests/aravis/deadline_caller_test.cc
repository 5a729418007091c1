#include "luxfield/hal/deadline_caller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "luxfield/core/error.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal {
namespace {

using testing::HasSubstr;

class DeadlineCalls : public testing::Test {
 protected:
  double Soon(double seconds) { return clock_->MonotonicSeconds() + seconds; }
  std::shared_ptr<core::Clock> clock_ = std::make_shared<core::SystemClock>();
};

TEST_F(DeadlineCalls, ReturnsAndThrowsWhatTheCallDoes) {
  DeadlineCaller caller("device", clock_);
  EXPECT_EQ(caller.Call("add", Soon(10), [] { return 1 + 1; }), 2);
  EXPECT_THROW(caller.Call("fail", Soon(10), []() -> int { throw InputError("no"); }), InputError);
  EXPECT_EQ(caller.Call("add", Soon(10), [] { return 2 + 2; }), 4);
}

// The thread may be late in noticing that a call has ended: neither is the next call refused then,
// nor does it still hold what the call owned.
TEST_F(DeadlineCalls, IsReadyForTheNextCallWhenOneReturns) {
  DeadlineCaller caller("device", clock_);
  for (int k = 0; k < 20000; ++k) {
    auto owned = std::make_shared<int>(k);
    const std::weak_ptr<int> watched = owned;
    ASSERT_EQ(caller.Call("give back", Soon(10), [owned = std::move(owned)] { return *owned; }), k);
    ASSERT_TRUE(watched.expired()) << k;
  }
}

TEST_F(DeadlineCalls, ACallThatHangsEndsByItsDeadlineAndBlocksTheDevice) {
  auto release = std::make_shared<std::promise<void>>();
  std::shared_future<void> released = release->get_future().share();
  auto ended = std::make_shared<std::promise<void>>();
  {
    DeadlineCaller caller("device", clock_);
    const double begin = clock_->MonotonicSeconds();
    try {
      caller.Call("hang", begin + 0.05, [released, ended] {
        released.wait();
        ended->set_value();
      });
      FAIL();
    } catch (const HardwareError& error) {
      EXPECT_EQ(error.fault, Fault::kTimeout);
      EXPECT_THAT(error.what(), HasSubstr("device: hang: has not ended by its deadline"));
    }
    EXPECT_GE(clock_->MonotonicSeconds(), begin + 0.05);
    try {
      caller.Call("next", Soon(10), [] {});
      FAIL();
    } catch (const HardwareError& error) {
      EXPECT_THAT(error.what(), HasSubstr("still hangs in \"hang\""));
    }
  }  // nor does the caller's end wait for it
  release->set_value();
  ended->get_future().wait();
}

}  // namespace
}  // namespace luxfield::hal
