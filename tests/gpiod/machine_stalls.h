// When the machine ran nobody: a virtual processor that its host takes away stands still for tens
// to hundreds of milliseconds, and no priority inside helps. A thread on each processor, above
// every thread of the program, sleeps and notes when it was woken too late.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace luxfield::hal {

class MachineStalls {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Without the right to real-time priorities, or where the calling thread has none, nothing is
  // watched: a thread of ordinary priority also waits for its own program.
  MachineStalls();
  ~MachineStalls();
  MachineStalls(const MachineStalls&) = delete;

  bool watched() const { return watched_; }
  // How much of [begin, end] at least one processor stood still, in milliseconds.
  double Within(TimePoint begin, TimePoint end);

 private:
  struct Stall {
    TimePoint begin, end;
  };
  struct Watcher {
    std::atomic<TimePoint> awake = TimePoint{};  // when it last was
    std::thread thread = {};
  };
  void Watch(Watcher& watcher, int processor, int priority);

  bool watched_ = false;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;  // of what follows
  std::vector<Stall> stalls_;
  std::deque<Watcher> watchers_;
};

}  // namespace luxfield::hal
