// Progress of long jobs; and Ctrl-C.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

namespace luxfield::core {

struct ExecutionState;

// Tells the execution that it is made in (execution.h) how far a job is. Thread-safe. One that is made
// while another lives is silent: the outermost job counts.
class Progress {
 public:
  Progress(std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Advance(std::uint64_t steps = 1, const std::string& note = {});

 private:
  void Report(std::uint64_t done, const std::string& note, bool ended) const;

  std::string label_;
  std::uint64_t total_;
  std::atomic<std::uint64_t> done_{0};
  std::chrono::steady_clock::time_point start_;
  std::shared_ptr<ExecutionState> execution_;  // null where nobody hears
};

// "12 s", "3 min 20 s", "2 h 05 min".
std::string FormatDuration(double seconds);

// For programs: from now on the first SIGINT, SIGTERM or SIGHUP is counted, and the second SIGINT or
// SIGTERM ends the process as if nobody handled it, whatever it is doing. Those within 0.1 s of the
// one before are of one press: `timeout` sends two. SIGHUP stays ignored where it was (`nohup`), and
// never counts as the second, since a terminal that closes may send several.
void InstallInterruptHandler();
// For programs that drive devices: the second is counted, too, and they see to it that they end. The
// third ends the process, or SIGALRM 10 s after the second.
void EndInOrderAtTheSecondInterrupt();
// Of the execution (execution.h), or what the handler has counted.
int InterruptCount();
void ThrowIfInterrupted();
void SetInterruptCountForTest(int count);

}  // namespace luxfield::core
