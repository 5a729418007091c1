#include "luxfield/view/scene_file/lamp_handles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::view {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec3;

constexpr double kParallel = 1e-3;  // sine of the angle between a ray and an axis
constexpr double kDegrees = 180 / std::numbers::pi;

double HalfHeight(const scene::Camera& camera) {
  return std::tan(camera.vertical_fov_deg / kDegrees / 2);
}

// The rotation by the smallest angle that takes one unit vector to another (Rodrigues' formula).
scene::Pose SmallestRotation(Vec3 from, Vec3 to) {
  const Vec3 v = Cross(from, to);
  const double c = Dot(from, to);
  scene::Pose rotation;
  if (c < -1 + 1e-12) {  // half a turn about any normal
    const Vec3 aside = std::abs(from.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    const Vec3 n = Normalized(Cross(from, aside));
    const double axis[3] = {n.x, n.y, n.z};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) rotation.linear[i][j] = 2 * axis[i] * axis[j] - (i == j);
    return rotation;
  }
  const double k[3][3] = {{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double square = 0;
      for (int m = 0; m < 3; ++m) square += k[i][m] * k[m][j];
      rotation.linear[i][j] = (i == j) + k[i][j] + square / (1 + c);
    }
  return rotation;
}

}  // namespace

std::optional<PicturePoint> SeenAt(const scene::Camera& camera, Vec3 point) {
  const Vec3 d = point - camera.position;
  const double forward = Dot(d, camera.forward);
  if (!(forward > 1e-9)) return {};
  const double half = HalfHeight(camera),
               aspect = static_cast<double>(camera.width) / camera.height;
  return PicturePoint{camera.width * (1 + Dot(d, camera.right) / (forward * half * aspect)) / 2,
                      camera.height * (1 - Dot(d, camera.up) / (forward * half)) / 2};
}

double HeightAt(const scene::Camera& camera, Vec3 point) {
  return 2 * HalfHeight(camera) * Dot(point - camera.position, camera.forward);
}

std::optional<double> AlongAxis(const scene::Camera& camera, PicturePoint pixel, Vec3 origin,
                                Vec3 axis) {
  const Vec3 d = Normalized(camera.Direction(pixel.column, pixel.row));
  const Vec3 w = camera.position - origin;
  const double ad = Dot(axis, d), sine_square = 1 - ad * ad;
  if (sine_square < kParallel * kParallel) return {};
  return (Dot(w, axis) - Dot(w, d) * ad) / sine_square;
}

Vec3 BesideInPicture(const scene::Camera& camera, PicturePoint pixel, Vec3 point) {
  const Vec3 ray = camera.Direction(pixel.column, pixel.row);
  const double distance = Dot(point - camera.position, camera.forward) / Dot(ray, camera.forward);
  return camera.position + distance * ray;
}

LampPlacement Aimed(const LampPlacement& lamp, Vec3 target) {
  LampPlacement aimed = lamp;
  if (lamp.look_at) {
    aimed.look_at = target;
    return aimed.WorldFromLuminaire() ? aimed : lamp;
  }
  const Vec3 line = target - lamp.position;
  if (Length(line) < 1e-9) return lamp;
  const scene::Pose pose = scene::RotationXyz(lamp.rotate_deg);
  aimed.rotate_deg = AnglesOf(SmallestRotation(pose.Vector({0, 0, 1}), Normalized(line)) * pose);
  return aimed;
}

// With M the reflection, z' = M z and y' = M y; x' = y' x z' = -M x.
LampPlacement Mirrored(const LampPlacement& lamp, Axis axis, double at) {
  constexpr double Vec3::*kCoordinates[] = {&Vec3::x, &Vec3::y, &Vec3::z};
  double Vec3::*const coordinate = kCoordinates[static_cast<int>(axis)];
  const auto reflected = [&](Vec3 v, double plane) {
    v.*coordinate = 2 * plane - v.*coordinate;
    return v;
  };
  LampPlacement mirrored = lamp;
  mirrored.position = reflected(lamp.position, at);
  if (lamp.look_at) {
    mirrored.look_at = reflected(*lamp.look_at, at);
    mirrored.up = reflected(lamp.up, 0);
    return mirrored;
  }
  const scene::Pose rotation = scene::RotationXyz(lamp.rotate_deg);
  const Vec3 columns[] = {-1 * reflected(rotation.Vector({1, 0, 0}), 0),
                          reflected(rotation.Vector({0, 1, 0}), 0),
                          reflected(rotation.Vector({0, 0, 1}), 0)};
  scene::Pose turned;
  for (std::size_t column = 0; column < 3; ++column) {
    turned.linear[0][column] = columns[column].x;
    turned.linear[1][column] = columns[column].y;
    turned.linear[2][column] = columns[column].z;
  }
  mirrored.rotate_deg = AnglesOf(turned);
  return mirrored;
}

// R = Rz Ry Rx has -sin y in its lower left corner.
Vec3 AnglesOf(const scene::Pose& rotation) {
  const auto& r = rotation.linear;
  const double sine = std::clamp(-r[2][0], -1.0, 1.0);
  const double y = std::asin(sine);
  if (std::abs(sine) > 1 - 1e-12)
    return {0, y * kDegrees, std::atan2(-r[0][1], r[1][1]) * kDegrees};
  return {std::atan2(r[2][1], r[2][2]) * kDegrees, y * kDegrees,
          std::atan2(r[1][0], r[0][0]) * kDegrees};
}

}  // namespace luxfield::view
