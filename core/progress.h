// Progress with an ETA on a terminal, plain lines elsewhere; and Ctrl-C.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace luxfield::core {

// On a terminal one line on stderr is redrawn at most ten times a second; elsewhere a line every
// 10 %. Thread-safe. Destroying it ends the line. One that is made while another lives is silent:
// the outermost job's line counts.
class Progress {
 public:
  Progress(std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Advance(std::uint64_t steps = 1, const std::string& note = {});

  static void SetQuiet(bool quiet);  // --quiet, and tests

 private:
  void Draw(std::uint64_t done, const std::string& note, bool last);

  std::string label_;
  std::uint64_t total_;
  std::atomic<std::uint64_t> done_{0};
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_, drawn_;
  std::uint64_t decile_ = 0;
  bool open_ = false;
  const bool nested_;
};

// "12 s", "3 min 20 s", "2 h 05 min".
std::string FormatDuration(double seconds);

// Counts SIGINT and SIGTERM from InstallInterruptHandler on. What a count means is the verb's:
// capture finishes its bracket at 1 and stops at 2; others throw Interrupted at their next check.
void InstallInterruptHandler();
int InterruptCount();
void ThrowIfInterrupted();
void SetInterruptCountForTest(int count);

}  // namespace luxfield::core
