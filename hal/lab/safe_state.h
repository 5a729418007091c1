// The safe condition of a lab of real devices: lamp off, stage at rest (docs/safety.md).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "luxfield/hal/lab/device_lab.h"
#include "luxfield/hal/safety/watchdog.h"

namespace luxfield::hal {

// Opens stage and lamp supply at the same time, which halts the one and switches the other off, and
// closes them again. What does not open is tried again until `within_s` have passed: the kernel may
// still be taking it from the process that had it. Returns what could not be made safe, and why.
std::vector<std::string> MakeSafe(const DeviceLab& lab, double within_s);

// A watchdog that makes the lab safe, and says on stderr what it did.
std::shared_ptr<Watchdog> StartWatchdog(const DeviceLab& lab);

}  // namespace luxfield::hal
