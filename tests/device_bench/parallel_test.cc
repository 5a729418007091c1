// Parallel loops of the program that is linked without TBB.
#include "luxfield/core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace luxfield::core {
namespace {

TEST(ParallelForOverThreads, TakesEveryIndexOnceInPiecesOfTheGrain) {
  for (const std::size_t count : {0, 1, 6, 7, 8, 1000}) {
    std::vector<std::atomic<int>> taken(count);
    ParallelFor(count, 7, [&](std::size_t begin, std::size_t end) {
      EXPECT_LE(end - begin, 7u);
      for (std::size_t k = begin; k < end; ++k) ++taken[k];
    });
    for (const auto& times : taken) EXPECT_EQ(times, 1) << count;
  }
}

TEST(ParallelForOverThreads, TakesNoMoreThreadsThanItMay) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  OnThreads(1, [&] {
    EXPECT_EQ(Threads(), 1);
    ParallelFor(50, 1, [&](std::size_t, std::size_t) {
      const std::lock_guard lock(mutex);
      threads.insert(std::this_thread::get_id());
    });
  });
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

// One failure is thrown, of a body that failed, and no piece is begun after it.
TEST(ParallelForOverThreads, PassesAFailureToTheCaller) {
  for (const int limit : {1, 0}) {
    std::atomic<int> begun = 0;
    OnThreads(limit, [&] {
      try {
        ParallelFor(100000, 1, [&](std::size_t begin, std::size_t) {
          ++begun;
          throw std::runtime_error(std::to_string(begin));
        });
        ADD_FAILURE() << "nothing is thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_LT(std::stoi(error.what()), Threads());
      }
    });
    EXPECT_LE(begun, static_cast<int>(std::thread::hardware_concurrency()));
  }
  EXPECT_NO_THROW(ParallelFor(10, 3, [](std::size_t, std::size_t) {}));
}

}  // namespace
}  // namespace luxfield::core
