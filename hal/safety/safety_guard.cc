#include "luxfield/hal/safety/safety_guard.h"

#include <fmt/format.h>

#include "luxfield/hal/safety/watchdog.h"

namespace luxfield::hal {
namespace {

constexpr double kSwitchOff_s = 1;

}  // namespace

SafetyGuard::SafetyGuard(Devices& devices) : devices_(devices) {
  if (devices_.inputs) devices_.inputs->OnTrip([this](const InputState& state) { Stop(state); });
}

SafetyGuard::~SafetyGuard() {
  if (devices_.inputs) devices_.inputs->OnTrip({});
}

void SafetyGuard::Stop(const InputState& state) {
  std::vector<std::string> failures;
  const auto attempt = [&failures](auto&& action) {
    try {
      action();
    } catch (const std::exception& error) {
      failures.emplace_back(error.what());
    }
  };
  attempt([this] { devices_.stage->Stop(); });
  if (devices_.supply)
    attempt([this] {
      devices_.supply->SetOutput(false, devices_.clock->MonotonicSeconds() + kSwitchOff_s);
    });
  const std::lock_guard lock(mutex_);
  tripped_ = Describe(state);
  failures_ = std::move(failures);
}

void SafetyGuard::ThrowIfUnsafe() {
  if (devices_.watchdog && !devices_.watchdog->alive())
    throw HardwareError(Fault::kStopped, "watchdog", "watch", "its process has ended",
                        "find out what ended it, then resume the session");
  if (!devices_.inputs) return;
  std::string what = Describe(devices_.inputs->State());
  std::vector<std::string> failures;
  {
    const std::lock_guard lock(mutex_);
    if (what.empty()) what = tripped_;
    failures = failures_;
  }
  if (what.empty()) return;
  if (!failures.empty())
    what += fmt::format(", and not everything could be stopped: {}", fmt::join(failures, "; "));
  HardwareError error(Fault::kStopped, devices_.inputs->identity(), "watch", what,
                      "make the lab safe, clear the input, and resume the session");
  error.position_lost = true;
  throw error;
}

SupplyState SafetyGuard::SwitchLampOn(double deadline_s) {
  ThrowIfUnsafe();
  SupplyState state;
  try {
    state = devices_.supply->SetOutput(true, deadline_s);
    ThrowIfUnsafe();
  } catch (const HardwareError& error) {
    if (error.fault != Fault::kStopped) throw;
    // The trip's own order may have gone out before this one's.
    devices_.supply->SetOutput(false, devices_.clock->MonotonicSeconds() + kSwitchOff_s);
    ThrowIfUnsafe();  // rather than that the supply has given way
    throw;
  }
  return state;
}

}  // namespace luxfield::hal
