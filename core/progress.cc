#include "luxfield/core/progress.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"

namespace luxfield::core {
namespace {

std::atomic<bool> g_quiet{false};
std::atomic<int> g_living{0};
std::atomic<int> g_interrupts{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch it");

void CountInterrupt(int) { g_interrupts.fetch_add(1); }

}  // namespace

std::string FormatDuration(double seconds) {
  if (!(seconds >= 0)) seconds = 0;
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const auto s = static_cast<long long>(std::llround(seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

Progress::Progress(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(total),
      start_(std::chrono::steady_clock::now()),
      drawn_(start_),
      nested_(g_living.fetch_add(1) > 0) {}

Progress::~Progress() {
  g_living.fetch_sub(1);
  const std::lock_guard lock(mutex_);
  if (open_) std::fputc('\n', stderr);
}

void Progress::SetQuiet(bool quiet) { g_quiet = quiet; }

void Progress::Advance(std::uint64_t steps, const std::string& note) {
  const std::uint64_t done = done_.fetch_add(steps) + steps;
  if (g_quiet || nested_) return;
  const std::lock_guard lock(mutex_);
  Draw(done, note, done >= total_);
}

void Progress::Draw(std::uint64_t done, const std::string& note, bool last) {
  static const bool terminal = isatty(STDERR_FILENO);
  const auto now = std::chrono::steady_clock::now();
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double fraction = total_ ? static_cast<double>(done) / static_cast<double>(total_) : 1.0;
  std::string line = fmt::format("{} {:3.0f} %", label_, 100 * fraction);
  if (last)
    line += fmt::format("  in {}", FormatDuration(elapsed));
  else if (elapsed > 1)
    line += fmt::format("  ETA {}", FormatDuration(elapsed * (1 / fraction - 1)));
  if (!note.empty()) line += "  " + note;
  if (terminal) {
    if (!last && now - drawn_ < std::chrono::milliseconds(100)) return;
    drawn_ = now;
    ObeyedByTerminal("\r\033[K");
    fmt::print(stderr, "{}", OnOneLine(line));
    std::fflush(stderr);
    open_ = !last;
    if (last) std::fputc('\n', stderr);
  } else if (const auto decile = static_cast<std::uint64_t>(fraction * 10);
             decile > decile_ && (last || elapsed > 1)) {
    decile_ = decile;
    fmt::print(stderr, "{}\n", OnOneLine(line));
  }
}

void InstallInterruptHandler() {
  struct sigaction action {};
  action.sa_handler = &CountInterrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int InterruptCount() { return g_interrupts; }
void SetInterruptCountForTest(int count) { g_interrupts = count; }

void ThrowIfInterrupted() {
  if (g_interrupts > 0)
    throw Interrupted("interrupted; nothing half-written was left, run the same command again");
}

}  // namespace luxfield::core
