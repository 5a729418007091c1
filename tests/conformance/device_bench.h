// What every driver of hal::Camera, Selector, Supply, Meter and Inputs has to pass: instantiate the
// suites over a bench with the driver (docs/adding-a-driver.md; stages: tests/hal/).
//
//   INSTANTIATE_TEST_SUITE_P(Mine, CameraConformance,
//                            testing::Values(CameraDriver{"mine", OpenMine}), NameOfDevice);
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "luxfield/core/clock.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/instruments.h"

namespace luxfield::hal {

// A device and what can be done to it behind its driver's back. What a bench cannot do it says by
// returning false, and the tests that need it are skipped.
template <typename Device>
class DeviceBench {
 public:
  virtual ~DeviceBench() = default;
  virtual Device& device() = 0;
  virtual core::Clock& clock() = 0;                     // of the deadlines
  virtual bool Mute(bool /*mute*/) { return false; }    // it hears everything and answers nothing
  virtual bool Stick() { return false; }                // it stays where it is, whatever it is told
  virtual bool Trip(bool /*unsafe*/) { return false; }  // inputs: a contact opens, or closes again
  virtual std::optional<bool> Lit() { return {}; }      // supplies: whether the lamp really is on
  virtual bool in_real_time() const { return true; }    // other threads can come between
  virtual bool Close() { return false; }                // destroys the driver; the device stays
};

template <typename Device>
struct DeviceDriver {
  std::string name;
  std::function<std::unique_ptr<DeviceBench<Device>>()> open;
};

using CameraDriver = DeviceDriver<Camera>;
using SelectorDriver = DeviceDriver<Selector>;
using SupplyDriver = DeviceDriver<Supply>;
using MeterDriver = DeviceDriver<Meter>;
using InputsDriver = DeviceDriver<Inputs>;

inline constexpr auto NameOfDevice = [](const auto& info) { return info.param.name; };

template <typename Device>
class DeviceConformance : public testing::TestWithParam<DeviceDriver<Device>> {
 protected:
  void SetUp() override { bench_ = this->GetParam().open(); }

  Device& device() { return bench_->device(); }
  double In(double seconds) { return bench_->clock().MonotonicSeconds() + seconds; }
  // The fault that `action` ends in; nothing if it succeeds. Its text has to name the device's
  // operation and a remedy.
  static std::optional<Fault> FaultOf(const std::function<void()>& action) {
    try {
      action();
    } catch (const HardwareError& error) {
      EXPECT_FALSE(error.device.empty());
      EXPECT_FALSE(error.operation.empty());
      EXPECT_NE(std::string(error.what()).find("; "), std::string::npos) << "no remedy";
      return error.fault;
    }
    return {};
  }

  std::unique_ptr<DeviceBench<Device>> bench_;
};

class CameraConformance : public DeviceConformance<Camera> {};
class SelectorConformance : public DeviceConformance<Selector> {};
class SupplyConformance : public DeviceConformance<Supply> {};
class MeterConformance : public DeviceConformance<Meter> {};
class InputsConformance : public DeviceConformance<Inputs> {};

}  // namespace luxfield::hal
