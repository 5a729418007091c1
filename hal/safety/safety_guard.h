// What happens when a safety input trips: the stage stops, the lamp goes off.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "luxfield/hal/devices.h"

namespace luxfield::hal {

// While it lives, a trip of devices.inputs calls stage->Stop() and then supply->SetOutput(false)
// from the inputs' thread, whatever the program is doing: both have to be safe to call from another
// thread. The devices must outlive the guard. Without inputs it does nothing.
class SafetyGuard {
 public:
  explicit SafetyGuard(Devices& devices);
  ~SafetyGuard();
  SafetyGuard(const SafetyGuard&) = delete;
  SafetyGuard& operator=(const SafetyGuard&) = delete;

  // HardwareError(kStopped) if the watchdog has ended, or an input is unsafe now or has been since
  // this object was made; it says what tripped and what could not be stopped. Called before
  // anything moves, lights or exposes.
  void ThrowIfUnsafe();

  // Switches the supply on where that is allowed. A trip that comes meanwhile wins: the lamp is off
  // when HardwareError(kStopped) arrives.
  SupplyState SwitchLampOn(double deadline_s);

 private:
  void Stop(const InputState& state);

  Devices& devices_;
  std::mutex mutex_;
  std::string tripped_;
  std::vector<std::string> failures_;  // of Stop
};

}  // namespace luxfield::hal
