// Every driver of real devices that this version has.
#pragma once

#include <span>
#include <string_view>

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal {

// Those that are not built into this program included.
std::span<const Driver> AllDrivers();
// The one of that name, which is one of them.
const Driver& DriverNamed(std::string_view name);

}  // namespace luxfield::hal
