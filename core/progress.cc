#include "luxfield/core/progress.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <ctime>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/execution_state.h"

namespace luxfield::core {
namespace {

constexpr std::int64_t kOnePress_ms = 100;
constexpr unsigned kInOrder_s = 10;

std::atomic<int> g_interrupts{0};
std::atomic<std::int64_t> g_last_ms{-kOnePress_ms};
std::atomic<bool> g_ends_in_order{false};
static_assert(std::atomic<int>::is_always_lock_free &&
                  std::atomic<std::int64_t>::is_always_lock_free &&
                  std::atomic<bool>::is_always_lock_free,
              "a signal handler may touch them");

std::int64_t Now_ms() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return 1000 * std::int64_t{now.tv_sec} + now.tv_nsec / 1'000'000;
}

// More than one thread may be here at once.
void CountInterrupt(int signal) {
  if (signal == SIGHUP && g_interrupts > 0) return;
  const std::int64_t now = Now_ms();
  std::int64_t last = g_last_ms;
  if (now - last < kOnePress_ms || !g_last_ms.compare_exchange_strong(last, now)) return;
  const int count = g_interrupts.fetch_add(1) + 1;
  if (count < 2) return;
  if (count == 2 && g_ends_in_order) {
    ::signal(SIGALRM, SIG_DFL);
    ::alarm(kInOrder_s);
    return;
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);  // comes when this handler returns
}

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
      execution_(CurrentExecution()) {
  if (execution_ && execution_->jobs.fetch_add(1) > 0) {
    execution_->jobs.fetch_sub(1);
    execution_ = nullptr;
  }
}

Progress::~Progress() {
  if (!execution_) return;
  Report(done_, {}, true);
  execution_->jobs.fetch_sub(1);
}

void Progress::Advance(std::uint64_t steps, const std::string& note) {
  const std::uint64_t done = done_.fetch_add(steps) + steps;
  if (execution_) Report(done, note, false);
}

void Progress::Report(std::uint64_t done, const std::string& note, bool ended) const {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  const std::lock_guard lock(execution_->callbacks);
  if (!execution_->execution.progress) return;
  execution_->execution.progress({label_, note, done, total_, elapsed.count(), ended});
}

void InstallInterruptHandler() {
  struct sigaction action {};
  action.sa_handler = &CountInterrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  // While one is handled others wait, so that an end by one is not held up by another.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&action.sa_mask, signal);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (signal != SIGHUP || before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
}

void EndInOrderAtTheSecondInterrupt() { g_ends_in_order = true; }

int InterruptCount() {
  if (const std::shared_ptr<ExecutionState> execution = CurrentExecution()) {
    const std::lock_guard lock(execution->callbacks);
    if (execution->execution.interrupts) return execution->execution.interrupts();
  }
  return g_interrupts;
}
void SetInterruptCountForTest(int count) { g_interrupts = count; }

void ThrowIfInterrupted() {
  if (InterruptCount() > 0)
    throw Interrupted("interrupted; nothing half-written was left, run the same command again");
}

}  // namespace luxfield::core
