// How lab.toml becomes a rig with its devices (docs/formats/lab-and-plan.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/hal/devices.h"
#include "luxfield/hal/safety/stage_bounds.h"

namespace luxfield::hal {

// Opens the devices of lab.toml; if they are real, a watchdog is started before. The stage keeps
// within `plan` too, which is told on stderr where it would allow more than the lab. Throws
// InputError for a file that makes no sense, or a driver this version does not have, HardwareError
// for a device that does not answer.
Devices MakeDevices(const std::filesystem::path& lab_toml, std::optional<std::uint64_t> seed = {},
                    const StageBounds& plan = {});

// The drivers this program was built with, as `luxfield devices` lists them.
struct DriverInfo {
  std::string name, what;
};
std::vector<DriverInfo> Drivers();

}  // namespace luxfield::hal
