// What is looked at before the first exposure counts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/hal/safety/safety_guard.h"

namespace luxfield::capture {

// UTC less the rig's monotonic clock, in seconds: constant, but where somebody sets the time or the
// computer sleeps. Throws DeviceError for a time before 2000, which nobody has set: the session's
// records would be dated by it.
double ClockOffset(core::Clock& clock);

// "3 MiB are free, the capture may need 4 MiB", of bytes of which fewer are free than needed: rounded
// apart, so that the second number is the larger one.
std::string FreeAndNeeded(std::uint64_t free, std::uint64_t needed);

// Throws DeviceError if the disk has less than 1.3 times `bytes` free, or a safety input is
// active. Warns where inputs or watchdog may have to wait for other programs.
void CheckDiskAndSafety(std::uint64_t bytes, hal::Devices& devices,
                        const std::filesystem::path& folder);

// Switches the lamp on and waits until the monitor's readings stay within the plan's variation over
// its window. Returns how long it waited and the variation; throws DeviceError after max_wait_s,
// Interrupted on Ctrl-C.
struct WarmUp {
  double waited_s = 0, variation = 0, meter = 0;
};
WarmUp WaitForLamp(const WarmUpPolicy& policy, hal::Devices& devices, hal::SafetyGuard& guard);

// Of an operation that takes so long: half as much again and a margin, absolute on the rig's clock.
// The watchdog expects the next one by then.
double Deadline(hal::Devices& devices, double duration_s);

// On the rig's clock; the watchdog is told.
void Sleep(hal::Devices& devices, double duration_s);

// After the last exposure. The watchdog waits for nothing any more.
void SwitchLampOff(hal::Devices& devices);

}  // namespace luxfield::capture
