// The [camera] of a lab of real devices (docs/formats/lab-and-plan.md).
#pragma once

#include <array>
#include <variant>

#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/drivers/driver.h"
#include "luxfield/hal/options/rig_options.h"
#include "luxfield/rig/homography.h"

namespace luxfield::hal {

struct PixelPitch {
  double pitch_m = 0;
};

struct CameraOptions {
  DescribedCamera driver;
  std::variant<PixelPitch, Corners, rig::Homography> image_plane;  // where the pixels lie on I
  rig::SensorModel calibration;
};

// Throws InputError naming file and field.
CameraOptions ReadCamera(const core::Config& camera, rig::RigKind rig, int channels);

// image_from_sensor of session.json, for the frames that the opened camera gives.
rig::Homography ImageFromSensor(const CameraOptions& options,
                                const CameraCapabilities& capabilities);

}  // namespace luxfield::hal
