#include "luxfield/core/clock.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <thread>

namespace luxfield::core {
namespace {

std::string Iso8601(double unix_seconds) {
  const auto whole = static_cast<std::time_t>(std::floor(unix_seconds));
  const int milliseconds =
      std::min(999, static_cast<int>((unix_seconds - std::floor(unix_seconds)) * 1000));
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(whole), milliseconds);
}

}  // namespace

double SystemClock::MonotonicSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string SystemClock::UtcIso8601() {
  return Iso8601(
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
}

void SystemClock::SleepSeconds(double seconds) {
  if (seconds > 0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

std::string SimulatedClock::UtcIso8601() { return Iso8601(946684800.0 + now_s_); }

}  // namespace luxfield::core
