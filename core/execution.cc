#include "luxfield/core/execution.h"

#include <utility>

#include "luxfield/core/execution_state.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {
namespace {

thread_local std::shared_ptr<ExecutionState> t_current;

// Waits for a callback that is being made, after which a thread that still works is heard by nobody.
class EndOfExecution {
 public:
  explicit EndOfExecution(ExecutionState& state) : state_(state) {}
  ~EndOfExecution() {
    const std::lock_guard lock(state_.callbacks);
    state_.execution = {};
  }
  EndOfExecution(const EndOfExecution&) = delete;
  EndOfExecution& operator=(const EndOfExecution&) = delete;

 private:
  ExecutionState& state_;
};

}  // namespace

std::shared_ptr<ExecutionState> CurrentExecution() { return t_current; }

EnterExecution::EnterExecution(std::shared_ptr<ExecutionState> state)
    : before_(std::exchange(t_current, std::move(state))) {}
EnterExecution::~EnterExecution() { t_current = std::move(before_); }

void RunWith(Execution execution, const std::function<void()>& work) {
  const auto state = std::make_shared<ExecutionState>(std::move(execution));
  const EndOfExecution end(*state);
  OnThreads(state->threads, [&] {
    const EnterExecution enter(state);
    work();
  });
}

std::function<void()> InThisExecution(std::function<void()> work) {
  return [state = t_current, work = std::move(work)] {
    if (!state) return work();
    OnThreads(state->threads, [&] {
      const EnterExecution enter(state);
      work();
    });
  };
}

void Say(Severity severity, const std::string& message) {
  const std::shared_ptr<ExecutionState> state = t_current;
  if (!state) return;
  const std::lock_guard lock(state->callbacks);
  if (state->execution.message && state->said.insert(message).second)
    state->execution.message(severity, message);
}

}  // namespace luxfield::core
