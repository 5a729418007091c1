// core/parallel.h over std::thread, for the one program that is linked without TBB.
#include "luxfield/core/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "luxfield/core/execution_state.h"

namespace luxfield::core {
namespace {

thread_local int t_threads = 0;

}  // namespace

void OnThreads(int threads, const std::function<void()>& work) {
  const int before = std::exchange(t_threads, threads > 0 ? threads : t_threads);
  work();
  t_threads = before;
}

int Threads() {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  return t_threads > 0 ? std::min(t_threads, cores) : cores;
}

void ParallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body) {
  grain = std::max<std::size_t>(grain, 1);
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const std::shared_ptr<ExecutionState> execution = CurrentExecution();
  const auto work = [&] {
    const EnterExecution enter(execution);
    try {
      for (std::size_t begin; (begin = next.fetch_add(grain)) < count;)
        body(begin, std::min(begin + grain, count));
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> helpers;
    const std::size_t pieces = (count + grain - 1) / grain;
    for (std::size_t k = 1; k < std::min<std::size_t>(Threads(), pieces); ++k)
      helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace luxfield::core
