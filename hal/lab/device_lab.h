// A lab of real devices: [lab] driver = "devices" (docs/formats/lab-and-plan.md).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/options/camera_options.h"
#include "luxfield/hal/options/instrument_options.h"
#include "luxfield/hal/options/line_options.h"
#include "luxfield/hal/options/stage_options.h"

namespace luxfield::hal {

struct DeviceLab {
  rig::RigDescription rig;  // but image_from_sensor, which depends on what the camera gives
  CameraOptions camera;
  StageOptions stage;
  gpiod::SafetyInputsOptions inputs;
  gpiod::LineSelectorOptions shutter;
  std::optional<gpiod::LineSelectorOptions> print, colour;
  std::optional<gpiod::TriggerLineOptions> trigger;
  std::optional<LampSupplyOptions> supply;
  std::optional<UsbMeterOptions> monitor;
};

// Opens nothing. Throws InputError naming file and field for what is wrong, missing, unknown, or
// not built in.
DeviceLab ReadDeviceLab(const core::Config& config);

// The safety inputs alone.
std::unique_ptr<Inputs> OpenInputs(const DeviceLab& lab);

// Told of a device that does not open: its role ("camera") and why.
using OnRefusal = std::function<void(const std::string& role, const HardwareError& error)>;

// Inputs, supply (switched off), shutter (closed), changers, stage, monitor, trigger, camera: in
// this order,
// so that nothing opened later can do harm. Where an input is unsafe nothing else is opened:
// HardwareError(kStopped). HardwareError where a device does not answer; those opened before are
// closed again, the lamp off. With `on_refusal` such a device stays null and the next one follows.
Devices OpenDevices(const DeviceLab& lab, const OnRefusal& on_refusal = {});

}  // namespace luxfield::hal
