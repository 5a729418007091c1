// How hardware says no.
#pragma once

#include <string>

#include "luxfield/core/error.h"

namespace luxfield::hal {

enum class Fault {
  kTimeout,       // the deadline passed; the device must be configured again before it is used
  kRefused,       // the device did not accept the command or value
  kDisconnected,  // gone from the bus
  kOutOfRange,    // beyond the device's limits; nothing was done
  kNotHomed,      // the stage does not know where it is
  kStopped,       // emergency stop, door, or Stop() from another thread
  kProtocol,      // the device answered nonsense
  kIncomplete,    // a frame arrived damaged and was thrown away; another may be taken
};
std::string FaultName(Fault fault);

// Exit code 3. what() is "DEVICE: OPERATION: PROBLEM; REMEDY".
class HardwareError : public DeviceError {
 public:
  HardwareError(Fault fault, const std::string& device, const std::string& operation,
                const std::string& problem, const std::string& remedy);

  Fault fault;
  std::string device, operation, problem, remedy;
  bool position_lost = false;  // the stage must be homed before anything else
};

}  // namespace luxfield::hal
