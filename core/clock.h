// Time that tests can drive.
#pragma once

#include <chrono>
#include <string>

namespace luxfield::core {

// Everything that waits or stamps takes a Clock, so that hours of warm-up run in milliseconds in a
// test.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual double MonotonicSeconds() = 0;  // arbitrary origin, never goes back
  virtual std::string UtcIso8601() = 0;   // "2026-11-21T13:50:29.123Z"
  virtual void SleepSeconds(double seconds) = 0;
};

class SystemClock : public Clock {
 public:
  double MonotonicSeconds() override;
  std::string UtcIso8601() override;
  void SleepSeconds(double seconds) override;
};

// Simulated time: sleeping moves it at once. Starts at 0 s, 2000-01-01T00:00:00Z.
class SimulatedClock : public Clock {
 public:
  double MonotonicSeconds() override { return now_s_; }
  std::string UtcIso8601() override;
  void SleepSeconds(double seconds) override {
    if (seconds > 0) now_s_ += seconds;
  }

 private:
  double now_s_ = 0;
};

}  // namespace luxfield::core
