// The execution of a thread (execution.h), for progress.cc and parallel.cc.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "luxfield/core/execution.h"

namespace luxfield::core {

// Shared by the threads that work in it, of which one may outlive the call of RunWith.
struct ExecutionState {
  explicit ExecutionState(Execution of) : threads(of.threads), execution(std::move(of)) {}

  const int threads;
  std::atomic<int> jobs{0};  // that report progress
  std::mutex callbacks;      // of what follows
  Execution execution;       // nothing is left to call once RunWith has returned
  std::set<std::string> said;
};

// Null outside of any.
std::shared_ptr<ExecutionState> CurrentExecution();

// Makes it this thread's as long as this lives.
class EnterExecution {
 public:
  explicit EnterExecution(std::shared_ptr<ExecutionState> state);
  ~EnterExecution();
  EnterExecution(const EnterExecution&) = delete;
  EnterExecution& operator=(const EnterExecution&) = delete;

 private:
  std::shared_ptr<ExecutionState> before_;
};

}  // namespace luxfield::core
