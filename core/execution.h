// How calls of the library talk with who makes them. A call prints nothing and changes nothing of the
// process: what it has to say goes to the execution that it runs in, and the number of threads and the
// wish to stop come from there. Outside of any, calls are silent and take all cores.
//
//   core::RunWith({.message = [](core::Severity, const std::string& text) { Log(text); },
//                  .threads = 4},
//                 [&] { field = reconstruct::Reconstruct(measurements, options); });
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace luxfield::core {

struct ProgressReport {
  std::string label, note;
  std::uint64_t done = 0, total = 0;  // steps
  double elapsed_s = 0;
  bool ended = false;  // the last report of this job, finished or not
};

enum class Severity { kNote, kWarning };

// What is empty is not called. Callbacks come from any thread, one at a time; they must not throw.
struct Execution {
  std::function<void(Severity severity, const std::string& message)> message{};
  // Of the outermost job only.
  std::function<void(const ProgressReport& report)> progress{};
  // How often the caller has asked to stop. At 1 calls end at their next check by throwing Interrupted
  // and leave nothing half written; a capture finishes its bracket at 1 and stops at 2. Empty: what
  // the handler counts that the program installed, if it did (progress.h).
  std::function<int()> interrupts{};
  int threads = 0;  // 0 for all cores
};

// Runs `work` in that execution. Executions of several threads know nothing of each other.
void RunWith(Execution execution, const std::function<void()>& work);

// `work` for a thread that a call starts, in the execution of this thread. Where it goes on after the
// call of RunWith has returned, nobody hears it.
std::function<void()> InThisExecution(std::function<void()> work);

// To the execution's `message`; a message that it was given before is not given again.
void Say(Severity severity, const std::string& message);

}  // namespace luxfield::core
