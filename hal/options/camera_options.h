// The [camera] of a lab of real devices (docs/formats/lab-and-plan.md).
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <variant>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/drivers/aravis/aravis_camera.h"
#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"
#include "luxfield/hal/options/rig_options.h"
#include "luxfield/rig/homography.h"

namespace luxfield::hal {

struct PixelPitch {
  double pitch_m = 0;
};

struct CameraOptions {
  std::variant<aravis::AravisOptions, gphoto2::Gphoto2Options> driver;
  std::variant<PixelPitch, Corners, rig::Homography> image_plane;  // where the pixels lie on I
  rig::SensorModel calibration;
};

// Throws InputError naming file and field.
CameraOptions ReadCamera(const core::Config& camera, rig::RigKind rig, int channels);

// camera.settings of session.json (docs/formats/session.md).
std::map<std::string, std::string> SettingsOf(const CameraOptions& options);

// Whether a [trigger] has to be there.
bool NeedsTrigger(const CameraOptions& options);

// HardwareError where it does not answer or cannot be set as described.
std::unique_ptr<Camera> OpenCamera(const CameraOptions& options, std::shared_ptr<core::Clock> clock,
                                   std::shared_ptr<Trigger> trigger);

// image_from_sensor of session.json, for the frames that the opened camera gives.
rig::Homography ImageFromSensor(const CameraOptions& options,
                                const CameraCapabilities& capabilities);

}  // namespace luxfield::hal
