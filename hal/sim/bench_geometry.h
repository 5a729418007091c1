// Where the parts of the simulated bench stand: as the lab states it, and as it is
// ([errors.geometry]).
//
// Frame of I: origin at the foot of the perpendicular from the filter's centre, s along the
// projection of the filter's own u axis, t square to it, z along the light; I is z = 0, the
// filter's centre (0, 0, -delta).
#pragma once

#include <array>
#include <optional>

#include "luxfield/core/config.h"
#include "luxfield/rig/homography.h"
#include "luxfield/rig/lens.h"

namespace luxfield::hal::sim {

using lightfield::Vec2;
using lightfield::Vec3;

using Rotation = std::array<double, 9>;  // row-major

Vec3 operator*(const Rotation& r, Vec3 v);
Rotation operator*(const Rotation& a, const Rotation& b);
Rotation Transposed(const Rotation& r);
Rotation AboutX(double angle_rad);
Rotation AboutY(double angle_rad);
Rotation AboutZ(double angle_rad);

// x_camera = rotation * x_image + translation.
struct PlacedLens {
  rig::Lens lens;
  Rotation rotation{};
  Vec3 translation;
};

struct BenchGeometry {
  double delta_m = 0;
  // Of the filter plane: axes_filter = AboutY(y) AboutX(x), which leaves its u axis above s.
  Vec2 filter_tilt_rad;
  // How far the filter moves against the luminaire for one metre of the stage's set point.
  std::array<Vec3, 2> stage_axes{{{1, 0, 0}, {0, 1, 0}}};
  std::optional<PlacedLens> camera;   // reflector rig with [camera.lens]
  rig::Homography image_from_sensor;  // of pixel positions freed from distortion

  Vec2 ImageFromSensor(double column, double row) const;
  Vec2 FilterCentre(Vec2 setpoint) const {
    return {stage_axes[0].x * setpoint.x + stage_axes[1].x * setpoint.y,
            stage_axes[0].y * setpoint.x + stage_axes[1].y * setpoint.y};
  }
};

// [camera.lens]: a camera that looks at I from where it stands.
PlacedLens ReadLens(const core::Config& lens, int width, int height);

// What a camera without distortion sees of I; throws InputError naming [camera.lens] if a corner of
// its image does not.
rig::Homography ImageFromSensor(const PlacedLens& camera, int width, int height,
                                const core::Config& lens);

// [errors.geometry]: moves `geometry` from what the lab states to what it is. `on` false only
// checks the numbers.
void ReadGeometryErrors(const core::Config& errors, bool on, int width, int height,
                        BenchGeometry& geometry);

}  // namespace luxfield::hal::sim
