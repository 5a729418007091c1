// The execution of a thread (execution.h), for progress.cc and parallel.cc.
#pragma once

#include <atomic>
#include <mutex>
#include <set>
#include <string>

#include "luxfield/core/execution.h"

namespace luxfield::core {

struct ExecutionState {
  Execution execution;
  std::atomic<int> jobs{0};  // that report progress
  std::mutex callbacks;
  std::set<std::string> said;
};

// Null outside of any.
ExecutionState* CurrentExecution();

// Makes it this thread's as long as this lives.
class EnterExecution {
 public:
  explicit EnterExecution(ExecutionState* state);
  ~EnterExecution();
  EnterExecution(const EnterExecution&) = delete;
  EnterExecution& operator=(const EnterExecution&) = delete;

 private:
  ExecutionState* before_;
};

}  // namespace luxfield::core
