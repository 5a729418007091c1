#include "luxfield/hal/sim/bench_geometry.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace luxfield::hal::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Pixels of a camera without distortion from (s, t) on I.
rig::Homography SensorFromImage(const PlacedLens& camera) {
  const auto& [lens, r, t] = camera;
  std::array<double, 9> h{};
  const double z[3] = {r[6], r[7], t.z}, x[3] = {r[0], r[1], t.x}, y[3] = {r[3], r[4], t.y};
  for (int k = 0; k < 3; ++k) {
    h[k] = lens.focal_px.x * x[k] + lens.centre_px.x * z[k];
    h[3 + k] = lens.focal_px.y * y[k] + lens.centre_px.y * z[k];
    h[6 + k] = z[k];
  }
  return h;
}

}  // namespace

Vec3 operator*(const Rotation& r, Vec3 v) {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}

Rotation operator*(const Rotation& a, const Rotation& b) {
  Rotation c{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return c;
}

Rotation Transposed(const Rotation& r) {
  return {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]};
}

Rotation AboutX(double a) {
  return {1, 0, 0, 0, std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a)};
}
Rotation AboutY(double a) {
  return {std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a)};
}
Rotation AboutZ(double a) {
  return {std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a), 0, 0, 0, 1};
}

Vec2 BenchGeometry::ImageFromSensor(double column, double row) const {
  if (!camera) return image_from_sensor.Map({column, row});
  const Vec2 straight = camera->lens.Straight({column, row});
  return image_from_sensor.Map(straight);
}

PlacedLens ReadLens(const core::Config& config, int width, int height) {
  PlacedLens camera;
  const auto focal = config.Numbers("focal_px", 2);
  if (!(focal[0] > 1 && focal[1] > 1)) config.Fail("focal_px", "must be above 1");
  const auto centre = config.Numbers("centre_px", 2, {0.5 * width, 0.5 * height});
  const auto position = config.Numbers("position_m", 3);
  const auto target = config.Numbers("target_m", 2, {0, 0});
  const double roll = config.Number("roll_deg", 0, {-180, 180}) * kDegree;
  camera.lens.focal_px = {focal[0], focal[1]};
  camera.lens.centre_px = {centre[0], centre[1]};
  const Vec3 at{position[0], position[1], position[2]};
  if (std::abs(at.z) < 1e-3) config.Fail("position_m", "lies on the image plane");
  const Vec3 ahead = Normalized(Vec3{target[0], target[1], 0} - at);
  const Vec3 right = Normalized(Cross(ahead, Vec3{0, 1, 0})), down = Cross(ahead, right);
  camera.rotation = AboutZ(roll) * Rotation{right.x, right.y, right.z, down.x, down.y,
                                            down.z,  ahead.x, ahead.y, ahead.z};
  camera.translation = -1.0 * (camera.rotation * at);
  return camera;
}

rig::Homography ImageFromSensor(const PlacedLens& camera, int width, int height,
                                const core::Config& config) {
  const rig::Homography h = SensorFromImage(camera).Adjugate().Normalised();
  for (const double column : {0, width})
    for (const double row : {0, height}) {
      const Vec2 q = h.Map({column, row});
      const Vec3 seen = camera.rotation * Vec3{q.x, q.y, 0} + camera.translation;
      if (!(seen.z > 0 && std::isfinite(seen.z)))
        config.Fail("position_m", "sees past the image plane",
                    "tilt the camera less, or lengthen its focal_px");
    }
  return h;
}

void ReadGeometryErrors(const core::Config& config, bool on, int width, int height,
                        BenchGeometry& geometry) {
  BenchGeometry actual = geometry;
  actual.delta_m += config.Number("delta_m", 0, {-0.5 * geometry.delta_m, geometry.delta_m});
  const auto tilt = config.Numbers("filter_tilt_deg", 2, {0, 0});
  actual.filter_tilt_rad = {tilt[0] * kDegree, tilt[1] * kDegree};
  const auto scale = config.Numbers("stage_scale", 2, {0, 0});
  const auto slope = config.Numbers("stage_slope", 2, {0, 0});
  const double turn = config.Number("stage_turn_deg", 0, {-10, 10}) * kDegree;
  const double skew = config.Number("stage_skew_deg", 0, {-10, 10}) * kDegree;
  actual.stage_axes = {
      {{(1 + scale[0]) * std::cos(turn), (1 + scale[0]) * std::sin(turn), slope[0]},
       {-(1 + scale[1]) * std::sin(turn + skew), (1 + scale[1]) * std::cos(turn + skew),
        slope[1]}}};
  // The sensor, turned and shifted on I, or the camera where there is one.
  const auto shift = config.Numbers("sensor_shift_m", 2, {0, 0});
  const double rotation = config.Number("sensor_turn_deg", 0, {-10, 10}) * kDegree;
  const auto camera_shift = config.Numbers("camera_shift_m", 3, {0, 0, 0});
  const auto camera_turn = config.Numbers("camera_turn_deg", 3, {0, 0, 0});
  const double focal = config.Number("focal", 0, {-0.5, 0.5});
  const auto distortion = config.Numbers("distortion", 4, {0, 0, 0, 0});
  if (actual.camera) {
    PlacedLens& camera = *actual.camera;
    camera.rotation = AboutX(camera_turn[0] * kDegree) * AboutY(camera_turn[1] * kDegree) *
                      AboutZ(camera_turn[2] * kDegree) * camera.rotation;
    const Vec3 at = Transposed(geometry.camera->rotation) * (-1.0 * geometry.camera->translation) +
                    Vec3{camera_shift[0], camera_shift[1], camera_shift[2]};
    camera.translation = -1.0 * (camera.rotation * at);
    camera.lens.focal_px = (1 + focal) * camera.lens.focal_px;
    for (int k = 0; k < 4; ++k) camera.lens.distortion[k] = distortion[k];
    actual.image_from_sensor = ImageFromSensor(camera, width, height, config);
  } else {
    const double c = std::cos(rotation), s = std::sin(rotation);
    actual.image_from_sensor =
        rig::Homography({c, -s, shift[0], s, c, shift[1], 0, 0, 1}) * geometry.image_from_sensor;
  }
  if (on) geometry = actual;
}

}  // namespace luxfield::hal::sim
