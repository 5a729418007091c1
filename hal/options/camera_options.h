// The [camera] of a lab of real devices (docs/formats/lab-and-plan.md).
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <variant>

#include "core/clock.h"
#include "core/config.h"
#include "hal/aravis/aravis_camera.h"
#include "hal/devices.h"
#include "hal/gphoto2/gphoto2_camera.h"
#include "hal/homography.h"
#include "hal/rig_options.h"

namespace luxfield::hal {

struct PixelPitch {
  double pitch_m = 0;
};

struct CameraOptions {
  std::variant<aravis::AravisOptions, gphoto2::Gphoto2Options> driver;
  std::variant<PixelPitch, Corners, Homography> image_plane;  // where the pixels lie on I
  CameraCalibration calibration;
};

// Throws InputError naming file and field.
CameraOptions ReadCamera(const core::Config& camera, RigKind rig, int channels);

// camera.settings of session.json (docs/formats/session.md).
std::map<std::string, std::string> SettingsOf(const CameraOptions& options);

// Whether a [trigger] has to be there.
bool NeedsTrigger(const CameraOptions& options);

// HardwareError where it does not answer or cannot be set as described.
std::unique_ptr<Camera> OpenCamera(const CameraOptions& options, std::shared_ptr<core::Clock> clock,
                                   std::shared_ptr<Trigger> trigger);

// image_from_sensor of session.json, for the frames that the opened camera gives.
Homography ImageFromSensor(const CameraOptions& options, const CameraCapabilities& capabilities);

}  // namespace luxfield::hal
