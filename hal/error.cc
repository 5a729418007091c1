#include "hal/error.h"

#include <fmt/format.h>

#include <array>

namespace luxfield::hal {

std::string FaultName(Fault fault) {
  static constexpr std::array kNames = {"timeout",   "refused", "disconnected", "out of range",
                                        "not homed", "stopped", "protocol",     "incomplete"};
  return kNames[static_cast<std::size_t>(fault)];
}

HardwareError::HardwareError(Fault fault_, const std::string& device_,
                             const std::string& operation_, const std::string& problem,
                             const std::string& remedy)
    : DeviceError(fmt::format("{}: {}: {} ({}); {}", device_, operation_, problem,
                              FaultName(fault_), remedy)),
      fault(fault_),
      device(device_),
      operation(operation_) {}

}  // namespace luxfield::hal
