#include "luxfield/hal/error.h"

#include <fmt/format.h>

#include <array>

namespace luxfield::hal {

std::string FaultName(Fault fault) {
  static constexpr std::array kNames = {"timeout",   "refused", "disconnected", "out of range",
                                        "not homed", "stopped", "protocol",     "incomplete"};
  return kNames[static_cast<std::size_t>(fault)];
}

HardwareError::HardwareError(Fault fault_, const std::string& device_,
                             const std::string& operation_, const std::string& problem_,
                             const std::string& remedy_)
    : DeviceError(fmt::format("{}: {}: {} ({}); {}", device_, operation_, problem_,
                              FaultName(fault_), remedy_)),
      fault(fault_),
      device(device_),
      operation(operation_),
      problem(problem_),
      remedy(remedy_) {}

}  // namespace luxfield::hal
