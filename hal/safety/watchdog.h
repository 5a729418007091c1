// A process beside this one that makes the lab safe when this one dies or hangs.
//
// The watchdog is forked off before anything is opened, and holds one end of a socket. A dead
// process closes the other end, whatever killed it; a stopped or starved one falls silent. The
// watchdog then kills what is left of it, so that the kernel gives its devices free, and makes the
// lab safe by opening them itself. It has a session of its own: Ctrl-C, a closed terminal and
// SIGTERM do not reach it.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>

#include "luxfield/hal/transport/byte_stream.h"

namespace luxfield::hal {

struct WatchdogTimes {
  double beat_s = 0.2;     // between signs of life
  double silence_s = 2;    // without one this process counts as hanging
  double patience_s = 60;  // beyond what Expect was told
};

class Watchdog {
 public:
  // `make_safe` runs in the watchdog's process, above ordinary programs where the user may, with
  // what this one knows now; it is told whether
  // this process "died" or "hangs". To be called while this process has one thread: a fork copies
  // none but the caller. Throws DeviceError where the system has no process or socket left.
  using MakeSafe = std::function<void(const char* why)>;
  explicit Watchdog(MakeSafe make_safe, const WatchdogTimes& times = {});
  // Dismisses the watchdog. Devices are closed by then, the lamp off.
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  // The thread that drives the devices will call again within this time, or it counts as hanging.
  // Infinite (as at first): nothing moves or is lit.
  void Expect(double within_s);
  static constexpr double kUnbounded_s = std::numeric_limits<double>::infinity();

  // False once the watchdog is gone or reads no more: nothing may move or light up without it.
  bool alive() const { return alive_; }
  // False where the system refuses real-time priority, to this process and the watchdog's alike.
  bool real_time() const { return real_time_; }
  pid_t process() const { return child_; }

 private:
  void Beat();

  WatchdogTimes times_;
  int socket_ = -1;
  pid_t child_ = -1;
  bool real_time_ = false;
  std::atomic<bool> alive_ = true;

  std::mutex mutex_;  // of what follows
  std::condition_variable ending_changed_;
  bool ending_ = false;
  SteadyTime expected_;
  std::thread thread_;
};

}  // namespace luxfield::hal
