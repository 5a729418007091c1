#include "luxfield/core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "luxfield/core/execution_state.h"

namespace luxfield::core {
int Threads() {
  const auto allowed =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min({static_cast<int>(std::min<std::size_t>(allowed, 1 << 16)),
                   tbb::this_task_arena::max_concurrency(), tbb::info::default_concurrency()});
}

void OnThreads(int threads, const std::function<void()>& work) {
  if (threads <= 0) return work();
  tbb::task_arena(threads).execute(work);
}

void ParallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body) {
  const std::shared_ptr<ExecutionState> execution = CurrentExecution();
  try {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(grain, 1)),
        [&](const tbb::blocked_range<std::size_t>& range) {
          const EnterExecution enter(execution);
          body(range.begin(), range.end());
        },
        tbb::simple_partitioner());
  } catch (const std::runtime_error& error) {
    // TBB has no type of its own for a thread that the system refuses.
    if (!std::string_view(error.what()).starts_with("pthread_create")) throw;
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again),
                            "no thread");
  }
}

}  // namespace luxfield::core
