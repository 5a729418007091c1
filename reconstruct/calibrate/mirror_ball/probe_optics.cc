#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::reconstruct {
namespace {

using lightfield::Cross;
using lightfield::Dot;
using lightfield::Length;
using lightfield::Normalized;
using lightfield::Vec2;
using lightfield::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kOutlineTolerance = 1e-6;
constexpr int kDeepest = 8;  // halvings of a pixel's edge

// The pinhole's ray of a picture point in camera coordinates: right, up, forward. Unit.
Vec3 PinholeRay(const ProbeOptics& optics, const Circle& circle, Vec2 p) {
  const double focal = circle.radius / std::tan(optics.half_angle);
  return Normalized(
      {(p.x - optics.principal_point.x) / focal, (optics.principal_point.y - p.y) / focal, 1});
}

double AngleBetween(Vec3 a, Vec3 b) { return std::atan2(Length(Cross(a, b)), Dot(a, b)); }

// Angle to the axis at a share q of the rim's radius.
double FisheyeAngle(const ProbeOptics& optics, double q) {
  const double rim = 0.5 * optics.field_of_view;
  switch (optics.projection) {
    case FisheyeProjection::kEquidistant:
      return q * rim;
    case FisheyeProjection::kEquisolid:
      return 2 * std::asin(q * std::sin(0.5 * rim));
    case FisheyeProjection::kStereographic:
      return 2 * std::atan(q * std::tan(0.5 * rim));
    case FisheyeProjection::kOrthographic:
      return std::asin(q * std::sin(rim));
  }
  return 0;
}

// The direction in camera coordinates; p lies within the rim.
Vec3 InCamera(const ProbeOptics& optics, const Circle& circle, Vec2 p) {
  const double x = (p.x - circle.x) / circle.radius, y = (circle.y - p.y) / circle.radius;
  const double q = std::min(1.0, std::hypot(x, y));
  if (optics.kind == ProbeOptics::Kind::kFisheye) {
    const double theta = FisheyeAngle(optics, q), slope = q > 0 ? std::sin(theta) / q : 0;
    return {slope * x, slope * y, std::cos(theta)};
  }
  if (optics.half_angle == 0) {
    const double slope = 2 * std::sqrt(1 - q * q);
    return {slope * x, slope * y, 2 * q * q - 1};
  }
  // Lengths in units of the distance to the ball's centre.
  const Vec3 v = PinholeRay(optics, circle, p);
  const Vec3 centre = PinholeRay(optics, circle, {circle.x, circle.y});
  const double radius = std::sin(optics.half_angle), along = Dot(v, centre);
  const double half_chord = std::sqrt(std::max(0.0, along * along - 1 + radius * radius));
  const Vec3 n = (1 / radius) * ((along - half_chord) * v - centre);
  return Normalized(v - 2 * Dot(v, n) * n);
}

// Appends the curve over the picture's line from p0 to p1, its end left out.
struct EdgeTracer {
  const ProbeOptics& optics;
  const Circle& circle;
  double area;  // that may lie between the curve and its great circles
  std::vector<Vec3>& outline;

  void Trace(Vec2 p0, Vec3 d0, Vec2 p1, Vec3 d1, int depth) {
    const Vec2 middle = 0.5 * (p0 + p1);
    const Vec3 d = InCamera(optics, circle, middle);
    // Curve and chord enclose two thirds of chord times sagitta.
    if (depth == 0 || 2.0 / 3 * std::abs(Dot(d, Cross(d0, d1 - d0))) <= area) {
      outline.push_back(d0);
      return;
    }
    Trace(p0, d0, middle, d, depth - 1);
    Trace(middle, d, p1, d1, depth - 1);
  }
};

Vec3 InWorld(const CameraFrame& camera, Vec3 d) {
  return d.x * camera.right + d.y * camera.up + d.z * camera.forward;
}

}  // namespace

CameraFrame LevelCamera(double azimuth_deg, double elevation_deg) {
  const double a = kDegree * azimuth_deg, e = kDegree * elevation_deg;
  const Vec3 forward = {std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)};
  const Vec3 right = {std::cos(a), -std::sin(a), 0};
  return {right, Cross(right, forward), forward};
}

CameraFrame UpwardCamera(double top_azimuth_deg) {
  const double a = kDegree * top_azimuth_deg;
  const Vec3 forward = {0, 0, 1}, up = {std::sin(a), std::cos(a), 0};
  return {Cross(forward, up), up, forward};
}

double ProbeOptics::RimDistance(const Circle& circle, Vec2 p) const {
  if (half_angle == 0) return std::hypot(p.x - circle.x, p.y - circle.y) - circle.radius;
  const double angle =
      AngleBetween(PinholeRay(*this, circle, p), PinholeRay(*this, circle, {circle.x, circle.y}));
  const double focal = circle.radius / std::tan(half_angle), cosine = std::cos(half_angle);
  return (angle - half_angle) * focal / (cosine * cosine);
}

std::optional<Vec3> ProbeOptics::Direction(const Circle& circle, Vec2 p) const {
  if (RimDistance(circle, p) > 0) return {};
  return InWorld(camera, InCamera(*this, circle, p));
}

void ProbeOptics::PixelOutline(const Circle& circle, int row, int column, double margin,
                               std::vector<Vec3>& outline) const {
  outline.clear();
  const double x = column, y = row;
  const Vec2 corners[] = {{x, y}, {x, y + 1}, {x + 1, y + 1}, {x + 1, y}};
  Vec3 directions[4];
  for (int k = 0; k < 4; ++k) {
    if (RimDistance(circle, corners[k]) > -margin) return;
    directions[k] = InCamera(*this, circle, corners[k]);
  }
  // Next to the rim pixels are needles: their area by the diagonals, which bound the tolerance.
  const double area =
      0.5 * Length(Cross(directions[2] - directions[0], directions[3] - directions[1]));
  EdgeTracer tracer{*this, circle, kOutlineTolerance * area, outline};
  for (int k = 0; k < 4; ++k)
    tracer.Trace(corners[k], directions[k], corners[(k + 1) % 4], directions[(k + 1) % 4],
                 kDeepest);
  for (Vec3& d : outline) d = InWorld(camera, d);
}

}  // namespace luxfield::reconstruct
