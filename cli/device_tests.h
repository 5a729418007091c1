// luxfield devices test NAME: one device of a lab at work, within stated bounds.
#pragma once

#include <string>
#include <vector>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// "stage", "camera", "shutter", "print", "colour", "supply", "monitor", "trigger", "inputs".
const std::vector<std::string>& TestableDevices();

// Prints what it does and sees; the figures are what it returns. `reach_m` bounds the stage. Throws
// InputError for a device that the lab does not have, HardwareError.
core::Json TestDevice(const std::string& name, const std::string& lab_toml, double reach_m);

}  // namespace luxfield::cli
