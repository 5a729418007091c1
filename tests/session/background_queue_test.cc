#include "luxfield/session/background_queue.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <vector>

namespace luxfield::session {
namespace {

TEST(BackgroundQueue, DoesEverythingInOrder) {
  std::vector<int> done, expected;
  {
    BackgroundQueue queue(3);
    for (int n = 0; n < 1000; ++n) {
      queue.Push([&done, n] { done.push_back(n); });
      expected.push_back(n);
      if (n == 500) {
        queue.Settle();
        EXPECT_EQ(done, expected);
      }
    }
  }
  EXPECT_EQ(done, expected) << "the destructor does what waits";
}

TEST(BackgroundQueue, LetsNoMoreWaitThanItMay) {
  std::atomic<int> waiting = 0, most = 0;
  BackgroundQueue queue(2);
  for (int n = 0; n < 1000; ++n) {
    queue.Push([&] { --waiting; });
    most = std::max(most.load(), ++waiting);
  }
  queue.Settle();
  // Those that wait, and the one that is being done or has just been.
  EXPECT_LE(most, 4);
}

TEST(BackgroundQueue, ATaskSeesWhetherAnotherWaits) {
  BackgroundQueue queue(10);
  std::promise<void> all_pushed;
  std::vector<bool> waiting;
  for (int n = 0; n < 3; ++n)
    queue.Push([&, n] {
      if (n == 0) all_pushed.get_future().wait();
      waiting.push_back(queue.Waiting());
    });
  all_pushed.set_value();
  queue.Settle();
  EXPECT_EQ(waiting, (std::vector<bool>{true, true, false}));
}

TEST(BackgroundQueue, ItsThreadGivesWayToTheCaller) {
  const int caller = ::getpriority(PRIO_PROCESS, 0);
  if (caller == 19 || ::sched_getscheduler(0) != SCHED_OTHER)
    GTEST_SKIP() << "the test runs at the lowest priority, or at a real-time one";
  int background = caller;
  BackgroundQueue queue(1);
  queue.Push([&] { background = ::getpriority(PRIO_PROCESS, 0); });
  queue.Settle();
  EXPECT_GT(background, caller);
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), caller);
}

TEST(BackgroundQueue, AnErrorIsThrownOnceAndDropsWhatWaits) {
  BackgroundQueue queue(100);
  int done = 0;
  queue.Push([] { throw std::runtime_error("full"); });
  EXPECT_THROW(
      {
        for (;;) queue.Push([&] { ++done; });
      },
      std::runtime_error);
  queue.Settle();
  const int before = done;
  queue.Push([&] { ++done; });
  queue.Settle();
  EXPECT_EQ(done, before + 1);
}

}  // namespace
}  // namespace luxfield::session
