#include "tests/gpiod/machine_stalls.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>

namespace luxfield::hal {
namespace {

constexpr std::chrono::microseconds kTick(500), kLate(500);

}  // namespace

MachineStalls::MachineStalls() {
  sched_param own{};
  int policy = SCHED_OTHER;
  pthread_getschedparam(pthread_self(), &policy, &own);
  cpu_set_t processors;
  if (policy != SCHED_FIFO || own.sched_priority >= sched_get_priority_max(SCHED_FIFO) ||
      sched_getaffinity(0, sizeof processors, &processors) != 0)
    return;
  watched_ = true;
  for (int processor = 0; processor < CPU_SETSIZE; ++processor)
    if (CPU_ISSET(processor, &processors)) {
      Watcher& watcher = watchers_.emplace_back();
      watcher.thread = std::thread([this, &watcher, processor, priority = own.sched_priority + 1] {
        Watch(watcher, processor, priority);
      });
    }
}

MachineStalls::~MachineStalls() {
  stop_ = true;
  for (Watcher& watcher : watchers_) watcher.thread.join();
}

void MachineStalls::Watch(Watcher& watcher, int processor, int priority) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(processor, &one);
  pthread_setaffinity_np(pthread_self(), sizeof one, &one);
  const sched_param above{priority};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &above);
  while (!stop_) {
    const TimePoint due = std::chrono::steady_clock::now() + kTick;
    std::this_thread::sleep_until(due);
    const TimePoint woken = std::chrono::steady_clock::now();
    if (woken - due >= kLate) {
      const std::lock_guard lock(mutex_);
      stalls_.push_back({due, woken});
    }
    watcher.awake = woken;
  }
}

double MachineStalls::Within(TimePoint begin, TimePoint end) {
  // A processor that stands still tells when it is back.
  for (const Watcher& watcher : watchers_)
    while (watcher.awake.load() <= end) std::this_thread::sleep_for(kTick);
  const std::lock_guard lock(mutex_);
  std::sort(stalls_.begin(), stalls_.end(),
            [](const Stall& a, const Stall& b) { return a.begin < b.begin; });
  std::chrono::duration<double, std::milli> total{};
  TimePoint counted = begin;
  for (const Stall& stall : stalls_) {
    const TimePoint from = std::max(stall.begin, counted), to = std::min(stall.end, end);
    if (to <= from) continue;
    total += to - from;
    counted = to;
  }
  return total.count();
}

}  // namespace luxfield::hal
