// What libgpiod's errno means to who runs the lab.
#pragma once

#include <string>

#include "luxfield/hal/error.h"

namespace luxfield::hal::gpiod {

// "/dev/NAME" for a name, a path as it is.
std::string ChipPath(const std::string& chip);

// Names chip and operation ("request line emergency-stop"); `error` is an errno.
HardwareError GpioError(const std::string& chip, const std::string& operation, int error);

// A line that is in use; `holder` is what its user calls itself to the kernel, empty: nothing.
HardwareError LineHeld(const std::string& chip, const std::string& operation,
                       const std::string& line, const std::string& holder);

// A line that the chip does not have; `available` lists those that it names.
HardwareError NoSuchLine(const std::string& chip, const std::string& line,
                         const std::string& available);

}  // namespace luxfield::hal::gpiod
