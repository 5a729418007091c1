// Which direction a pixel of a light probe's photograph shows (docs/formats/probe.md).
#pragma once

#include <optional>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::reconstruct {

enum class FisheyeProjection { kEquidistant, kEquisolid, kStereographic, kOrthographic };

// Where the circle of ball or lens lies, pixels from the upper left corner of the picture, x to the
// right, y down (pixel (row, column) covers [column, column + 1] x [row, row + 1]).
struct Circle {
  double x = 0, y = 0, radius = 0;
};

// Unit vectors in the world: to the right and up in the picture, and into it.
struct CameraFrame {
  lightfield::Vec3 right, up, forward;
};
// Of a camera that looks in a compass direction (0: +y, 90: +x) and an elevation.
CameraFrame LevelCamera(double azimuth_deg, double elevation_deg);
// Of one that looks up, the picture's top in a compass direction.
CameraFrame UpwardCamera(double top_azimuth_deg);

// A mirroring ball from infinitely far or through a pinhole, or a fisheye.
//
//   ball, orthographic   q = (p - centre) / radius,
//                        w = (2 q^2 - 1) forward + 2 sqrt(1 - q^2) (q.x right + q.y up)
//   ball, pinhole        v = ray of the pixel, n = (hit - c) / R, w = v - 2 (v . n) n,
//                        with the ball centred at distance d: sin(alpha) = R / d.
//                        The circle stands for the cone of half angle alpha around the ray of its
//                        centre; its radius is that of the ball's image were it on the optical
//                        axis, f tan(alpha), f the focal length
//   fisheye              angle theta to forward by the projection, field_of_view / 2 at q = 1
struct ProbeOptics {
  enum class Kind { kBall, kFisheye };
  Kind kind = Kind::kBall;
  CameraFrame camera;
  double half_angle = 0;               // alpha, radians; 0: orthographic
  lightfield::Vec2 principal_point{};  // pixels, for the pinhole
  FisheyeProjection projection = FisheyeProjection::kEquidistant;
  double field_of_view = 0;  // radians, across the rim

  // How far outside of the rim a point of the picture lies, pixels; negative inside.
  double RimDistance(const Circle& circle, lightfield::Vec2 p) const;
  // Absent outside of the rim. Unit.
  std::optional<lightfield::Vec3> Direction(const Circle& circle, lightfield::Vec2 p) const;
  // Around the pixel: its corners, and points between them until great circles are within 1e-6 of
  // the pixel's solid angle. Empty if a part of it is nearer to the rim than `margin`, pixels.
  void PixelOutline(const Circle& circle, int row, int column, double margin,
                    std::vector<lightfield::Vec3>& outline) const;
};

}  // namespace luxfield::reconstruct
