// Deadlines for libraries that keep none.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>

#include "luxfield/core/clock.h"

namespace luxfield::hal {

// Runs calls one at a time on a thread of its own and gives up waiting at their deadline. A call
// that was given up goes on alone; as long as it does, further calls fail at once. Calls must own
// what they use (by value or shared pointer): they may outlive the caller, which never waits for
// them either.
class DeadlineCaller {
 public:
  DeadlineCaller(std::string device, std::shared_ptr<core::Clock> clock);
  ~DeadlineCaller();
  DeadlineCaller(const DeadlineCaller&) = delete;
  DeadlineCaller& operator=(const DeadlineCaller&) = delete;

  // What `call` returns or throws; what it owned is gone by then. HardwareError(kTimeout) that
  // names device and operation when it has not ended by the deadline, or a call before has not
  // ended yet.
  template <typename Callable>
  auto Call(const std::string& operation, double deadline_s, Callable call) {
    using Result = decltype(call());
    auto promise = std::make_shared<std::promise<Result>>();
    std::future<Result> result = promise->get_future();
    Start(operation, [promise, call = std::move(call)]() mutable -> Deliver {
      try {
        if constexpr (std::is_void_v<Result>) {
          call();
          return [promise] { promise->set_value(); };
        } else {
          auto value = std::make_shared<Result>(call());
          return [promise, value] { promise->set_value(std::move(*value)); };
        }
      } catch (...) {
        return [promise, error = std::current_exception()] { promise->set_exception(error); };
      }
    });
    if (result.wait_for(TimeTo(deadline_s)) != std::future_status::ready) GiveUp(operation);
    return result.get();
  }

 private:
  // Hands a result over, once the thread is ready for the next call.
  using Deliver = std::function<void()>;
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::function<Deliver()> job;
    std::string busy_with;  // empty: idle
    bool end = false;
  };

  static void Run(const std::shared_ptr<Shared>& shared);
  void Start(const std::string& operation, std::function<Deliver()> job);
  std::chrono::duration<double> TimeTo(double deadline_s) const;
  [[noreturn]] void GiveUp(const std::string& operation) const;

  std::string device_;
  std::shared_ptr<core::Clock> clock_;
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::thread thread_;
};

}  // namespace luxfield::hal
