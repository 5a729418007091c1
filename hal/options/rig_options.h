// What a lab.toml says of its rig, print and sensor, be the lab simulated or real
// (docs/formats/lab-and-plan.md). All throw InputError naming file and field.
#pragma once

#include <array>

#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::hal {

// [rig] and [filter]: kind, delta, albedo and the print. The other fields stay as they are.
rig::RigDescription ReadRig(const core::Config& config);

// Where the sensor's corners lie on I: top left, top right, bottom right, bottom left.
using Corners = std::array<lightfield::Vec2, 4>;
// corners_m of [camera].
Corners ReadCorners(const core::Config& camera);
// A sensor centred on the filter's axis, row 0 at +t.
Corners CornersOfPixels(double pitch_m, int width, int height);

}  // namespace luxfield::hal
