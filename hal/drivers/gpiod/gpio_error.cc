#include "luxfield/hal/drivers/gpiod/gpio_error.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "luxfield/hal/permission.h"

namespace luxfield::hal::gpiod {

std::string ChipPath(const std::string& chip) {
  return chip.starts_with('/') ? chip : "/dev/" + chip;
}

HardwareError GpioError(const std::string& chip, const std::string& operation, int error) {
  const auto make = [&](Fault fault, const char* remedy) {
    return HardwareError(fault, ChipPath(chip), operation, std::strerror(error), remedy);
  };
  switch (error) {
    case ENOENT:
    case ENODEV:
      return make(Fault::kDisconnected, "plug the adapter in, or name the right chip in lab.toml");
    case EACCES:
    case EPERM:
      return make(Fault::kRefused, kJoinGpio);
    case ENXIO:
      return make(Fault::kRefused, "its pin cannot detect edges: wire the input to one that can");
    case EINVAL:
    case EOPNOTSUPP:
      return make(Fault::kRefused, "the chip cannot do that: check bias and direction in lab.toml");
    default:
      return make(Fault::kProtocol, "check the adapter and its cable");
  }
}

HardwareError LineHeld(const std::string& chip, const std::string& operation,
                       const std::string& line, const std::string& holder) {
  return {Fault::kRefused, ChipPath(chip), operation,
          holder.empty() ? fmt::format("line {} is held by another program", line)
                         : fmt::format("line {} is held by \"{}\"", line, holder),
          "end the program that holds the line (see gpioinfo)"};
}

HardwareError NoSuchLine(const std::string& chip, const std::string& line,
                         const std::string& available) {
  return {Fault::kRefused, ChipPath(chip), fmt::format("find line {}", line),
          "the chip has no such line",
          available.empty() ? std::string("name it by its offset: the chip names none")
                            : fmt::format("choose one of {}", available)};
}

}  // namespace luxfield::hal::gpiod
