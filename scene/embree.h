// Embree handles that release themselves and errors that are exceptions; for the .cc files of
// scene/.
#pragma once

#include <embree3/rtcore.h>

#include <string>

#include "luxfield/core/error.h"

namespace luxfield::scene {

class EmbreeDevice {
 public:
  EmbreeDevice() : device_(rtcNewDevice(nullptr)) {
    if (!device_) Fail("opening a device");
  }
  ~EmbreeDevice() {
    if (device_) rtcReleaseDevice(device_);
  }
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;
  RTCDevice get() const { return device_; }

  [[noreturn]] void Fail(const std::string& what) const {
    throw DeviceError("Embree: " + what + " failed with error " +
                      std::to_string(rtcGetDeviceError(device_)));
  }
  // Throws if any call since the last check failed.
  void Check(const std::string& what) const {
    const RTCError error = rtcGetDeviceError(device_);
    if (error != RTC_ERROR_NONE)
      throw DeviceError("Embree: " + what + " failed with error " + std::to_string(error));
  }

 private:
  RTCDevice device_;
};

class EmbreeBvh {
 public:
  explicit EmbreeBvh(const EmbreeDevice& device) : bvh_(rtcNewBVH(device.get())) {
    if (!bvh_) device.Fail("making a hierarchy");
  }
  ~EmbreeBvh() { rtcReleaseBVH(bvh_); }
  EmbreeBvh(const EmbreeBvh&) = delete;
  EmbreeBvh& operator=(const EmbreeBvh&) = delete;
  RTCBVH get() const { return bvh_; }

 private:
  RTCBVH bvh_;
};

}  // namespace luxfield::scene
