#include "luxfield/core/execution.h"

#include <utility>

#include "luxfield/core/execution_state.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {
namespace {

thread_local ExecutionState* t_current = nullptr;

}  // namespace

ExecutionState* CurrentExecution() { return t_current; }

EnterExecution::EnterExecution(ExecutionState* state) : before_(std::exchange(t_current, state)) {}
EnterExecution::~EnterExecution() { t_current = before_; }

void RunWith(Execution execution, const std::function<void()>& work) {
  ExecutionState state;
  state.execution = std::move(execution);
  OnThreads(state.execution.threads, [&] {
    const EnterExecution enter(&state);
    work();
  });
}

std::function<void()> InThisExecution(std::function<void()> work) {
  return [state = t_current, work = std::move(work)] {
    if (!state) return work();
    OnThreads(state->execution.threads, [&] {
      const EnterExecution enter(state);
      work();
    });
  };
}

void Say(Severity severity, const std::string& message) {
  ExecutionState* state = t_current;
  if (!state || !state->execution.message) return;
  const std::lock_guard lock(state->callbacks);
  if (state->said.insert(message).second) state->execution.message(severity, message);
}

}  // namespace luxfield::core
