#include "luxfield/view/lighting/camera_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::view {
namespace {

using lightfield::Vec3;

constexpr double kUpright = 0.5 * std::numbers::pi - 0.02;  // largest pitch
constexpr double kNearestPivot_m = 1e-3, kFarthestPivot_m = 1e5;

Vec3 NearestAxis(Vec3 v) {
  const double x = std::abs(v.x), y = std::abs(v.y), z = std::abs(v.z);
  const auto sign = [](double value) { return value < 0 ? -1.0 : 1.0; };
  if (z >= x && z >= y) return {0, 0, sign(v.z)};
  if (y >= x) return {0, sign(v.y), 0};
  return {sign(v.x), 0, 0};
}

}  // namespace

CameraControl::CameraControl(const scene::Camera& camera, double pivot_m)
    : camera_(camera), up_(NearestAxis(camera.up)) {
  SetPivot(pivot_m);
}

void CameraControl::SetPivot(double distance_m) {
  pivot_m_ = std::clamp(distance_m, kNearestPivot_m, kFarthestPivot_m);
}

void CameraControl::Look(Vec3 position, Vec3 forward) {
  camera_ = scene::Camera::LookAt(position, position + forward, up_, camera_.vertical_fov_deg,
                                  camera_.width, camera_.height);
}

Vec3 CameraControl::Turned(double yaw, double pitch) const {
  const Vec3 forward = lightfield::Normalized(camera_.forward);
  const double height = std::clamp(lightfield::Dot(forward, up_), -1.0, 1.0);
  const double now = std::asin(height);
  // A camera that looks along the axis has its own upward direction ahead.
  Vec3 level = forward - height * up_;
  if (lightfield::Length(level) < 1e-9) level = height < 0 ? camera_.up : -1.0 * camera_.up;
  level = lightfield::Normalized(level);
  const Vec3 right = lightfield::Cross(level, up_);
  const Vec3 ahead = std::cos(yaw) * level + std::sin(yaw) * right;
  const double then = std::clamp(now + pitch, -kUpright, kUpright);
  return std::cos(then) * ahead + std::sin(then) * up_;
}

void CameraControl::Orbit(double yaw, double pitch) {
  const Vec3 pivot = camera_.position + pivot_m_ * lightfield::Normalized(camera_.forward);
  // The camera goes to the right where it looks to the left, and up where it looks down.
  const Vec3 forward = Turned(-yaw, -pitch);
  Look(pivot - pivot_m_ * forward, forward);
}

void CameraControl::Turn(double yaw, double pitch) { Look(camera_.position, Turned(yaw, pitch)); }

void CameraControl::Pan(double right, double up) {
  const double height_m =
      2 * pivot_m_ * std::tan(camera_.vertical_fov_deg * std::numbers::pi / 360);
  camera_.position =
      camera_.position + height_m * right * camera_.right + height_m * up * camera_.up;
}

void CameraControl::Dolly(double factor) {
  const double before = pivot_m_;
  SetPivot(pivot_m_ * factor);
  camera_.position =
      camera_.position + (before - pivot_m_) * lightfield::Normalized(camera_.forward);
}

void CameraControl::Fly(double right, double up, double forward) {
  camera_.position = camera_.position + right * camera_.right + up * camera_.up +
                     forward * lightfield::Normalized(camera_.forward);
}

void CameraControl::SetFieldOfView(double vertical_deg) {
  camera_.vertical_fov_deg = std::clamp(vertical_deg, 0.01, 170.0);
}

}  // namespace luxfield::view
