// Runs a fake device behind a pseudo terminal: whoever opens port() talks to it as to a serial
// port.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "tests/fakes/fake_device.h"

namespace luxfield::fakes {

class PtyHost {
 public:
  using Look = std::function<void(FakeDevice&)>;

  // The device lives `speed_up` times faster than the wall clock. `after_step` sees it after each
  // of its steps, before what it says of them goes out.
  explicit PtyHost(std::unique_ptr<FakeDevice> device, double speed_up = 1, Look after_step = {});
  ~PtyHost();
  PtyHost(const PtyHost&) = delete;
  PtyHost& operator=(const PtyHost&) = delete;

  const std::string& port() const { return port_; }
  // Between two of the device's steps.
  bool Suffer(std::string_view event);
  // From here on bytes take `each_way_s` to pass the line, in either direction.
  void Delay(double each_way_s);
  // A frozen device takes and says nothing; its line stays open and its motion goes on.
  void Freeze(bool frozen);
  // Looks at the device between two of its steps.
  void Inspect(const Look& look);

 private:
  using Clock = std::chrono::steady_clock;
  // Bytes under way in one direction.
  class Way {
   public:
    void Put(std::string bytes, Clock::time_point arrival);
    // What has arrived by `now`.
    std::string Take(Clock::time_point now);
    bool empty() const { return under_way_.empty(); }

   private:
    std::deque<std::pair<Clock::time_point, std::string>> under_way_;
  };

  void Run();
  void Wake();

  std::unique_ptr<FakeDevice> device_;
  double speed_up_;
  Look after_step_;
  int master_ = -1, slave_ = -1, wake_ = -1;
  std::string port_;
  std::mutex mutex_;
  bool frozen_ = false;
  Clock::duration each_way_{};
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

}  // namespace luxfield::fakes
