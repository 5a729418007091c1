// Errors of aravis' calls as ours, and registers read until two answers agree.
#pragma once

#include <arv.h>

#include <string>

#include "luxfield/hal/error.h"

namespace luxfield::hal::aravis {

// A GError, and what it means.
class Result {
 public:
  Result(std::string device, std::string operation);
  ~Result() { g_clear_error(&error_); }
  Result(const Result&) = delete;
  Result& operator=(const Result&) = delete;

  operator GError**() {
    g_clear_error(&error_);
    return &error_;
  }
  bool failed() const { return error_ != nullptr; }
  void ThrowIfFailed() const;

 private:
  std::string device_, operation_;
  GError* error_ = nullptr;
};

// The remedy where a camera is not found: aravis passes over those on USB that it may not open.
inline constexpr const char* kNotFound =
    "check cable, power and network, and join the group plugdev for one on USB "
    "(docs/how-to/permissions.md); `luxfield devices` lists what is there";

// Of a setting that the camera does not have, or take.
HardwareError Refused(const std::string& device, const std::string& operation,
                      const std::string& problem);

// What a register holds, for a number on which frames or their meaning depend: an answer may be
// damaged, so two in a row must agree.
template <typename Reading>
auto Agreed(const std::string& device, const char* operation, const Reading& reading) {
  constexpr int kReadings = 5;
  Result result(device, operation);
  auto last = reading(result);
  result.ThrowIfFailed();
  for (int k = 1; k < kReadings; ++k) {
    auto next = reading(result);
    result.ThrowIfFailed();
    if (next == last) return next;
    last = next;
  }
  throw HardwareError(Fault::kProtocol, device, operation,
                      "a register reads differently from one time to the next",
                      "check the cable, then power-cycle the camera");
}

}  // namespace luxfield::hal::aravis
