// What serial ports, ptys and sockets have in common, and how long to wait for them.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "luxfield/core/clock.h"

namespace luxfield::hal {

using SteadyTime = std::chrono::steady_clock::time_point;

inline SteadyTime SecondsFromNow(double seconds) {
  // Far beyond any wait, and well inside what the clock can count.
  constexpr double kLongest_s = 1e8;
  const double bounded = seconds < kLongest_s ? seconds : kLongest_s;
  return std::chrono::steady_clock::now() +
         std::chrono::duration_cast<std::chrono::steady_clock::duration>(
             std::chrono::duration<double>(bounded));
}

// Devices wait in real time. A deadline on the rig's clock leaves them as much of it as that clock
// still has to go, be it a simulated one.
inline SteadyTime OnSteadyClock(double deadline_s, core::Clock& rig_clock) {
  return SecondsFromNow(deadline_s - rig_clock.MonotonicSeconds());
}

class ByteStream {
 public:
  virtual ~ByteStream() = default;
  // For messages: "/dev/ttyUSB0".
  virtual const std::string& name() const = 0;

  // Waits for input until the deadline and takes what is there, at most buffer.size() bytes; 0 only
  // if the deadline has passed. HardwareError(kDisconnected) if the other end is gone.
  virtual std::size_t Read(std::span<char> buffer, SteadyTime deadline) = 0;

  // Hands over all bytes. HardwareError(kTimeout) if the deadline passes before: an unknown part
  // has been sent; kDisconnected. Any thread may write while another one reads; the bytes of one
  // call stay together if it succeeds at once, which calls of a few dozen bytes do.
  virtual void Write(std::string_view bytes, SteadyTime deadline) = 0;
};

}  // namespace luxfield::hal
