// Projective maps of the plane.
#pragma once

#include <array>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::rig {

using Homography = std::array<double, 9>;  // row-major, on (x, y, 1)

// The map that takes the corners (0, 0), (width, 0), (width, height), (0, height) to the four
// points, in that order.
Homography FromCorners(double width, double height, const std::array<lightfield::Vec2, 4>& points);

inline lightfield::Vec2 Apply(const Homography& h, double x, double y) {
  const double w = h[6] * x + h[7] * y + h[8];
  return {(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w};
}

}  // namespace luxfield::rig
