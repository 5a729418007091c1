#include "luxfield/hal/drivers/aravis/result.h"

#if LUXFIELD_ARAVIS

#include <utility>

namespace luxfield::hal::aravis {

Result::Result(std::string device, std::string operation)
    : device_(std::move(device)), operation_(std::move(operation)) {}

void Result::ThrowIfFailed() const {
  if (!error_) return;
  Fault fault = Fault::kProtocol;
  const char* remedy = "check cable and power, then reconnect the camera";
  if (error_->domain == ARV_GC_ERROR && error_->code == ARV_GC_ERROR_ENUM_ENTRY_NOT_FOUND) {
    fault = Fault::kRefused;
    remedy = "choose a setting that the camera has";
  }
  if (error_->domain == ARV_DEVICE_ERROR) switch (error_->code) {
      case ARV_DEVICE_ERROR_NOT_FOUND:
        remedy = kNotFound;
        [[fallthrough]];
      case ARV_DEVICE_ERROR_NOT_CONNECTED:
        fault = Fault::kDisconnected;
        break;
      case ARV_DEVICE_ERROR_TIMEOUT:
        fault = Fault::kTimeout;
        break;
      case ARV_DEVICE_ERROR_NOT_CONTROLLER:
        fault = Fault::kRefused;
        remedy = "end the program that controls the camera";
        break;
      case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND:
      case ARV_DEVICE_ERROR_INVALID_PARAMETER:
      case ARV_DEVICE_ERROR_WRONG_FEATURE:
        fault = Fault::kRefused;
        remedy = "choose a setting that the camera has";
        break;
      default:
        break;
    }
  throw HardwareError(fault, device_, operation_, error_->message, remedy);
}

HardwareError Refused(const std::string& device, const std::string& operation,
                      const std::string& problem) {
  return {Fault::kRefused, device, operation, problem, "choose a setting that the camera has"};
}

}  // namespace luxfield::hal::aravis

#endif
