// A camera with a lens: pin-hole and Brown's distortion, in pixels with edges at whole numbers.
//
//   x = X/Z, y = Y/Z (camera frame: x right, y down, z ahead),   r^2 = x^2 + y^2
//   x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)
//   y' = y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y
//   column = fx x' + cx,   row = fy y' + cy
//
// D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37 (1971);
// coefficients in OpenCV's order. OpenCV's pixels have their centres at whole numbers: its cx is
// ours - 0.5.
#pragma once

#include <array>
#include <cmath>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::rig {

// x, y and the result are a scalar of any kind (double, or one that differentiates).
template <typename T>
std::array<T, 2> Distort(const std::array<T, 4>& k, const T& x, const T& y) {
  const T r2 = x * x + y * y, radial = 1.0 + r2 * (k[0] + r2 * k[1]);
  return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

struct Lens {
  lightfield::Vec2 focal_px;
  lightfield::Vec2 centre_px;
  std::array<double, 4> distortion{};  // k1, k2, p1, p2

  // Where the ray (x, y, 1) of the camera frame lands.
  lightfield::Vec2 PixelOf(lightfield::Vec2 ray) const {
    const auto [x, y] = Distort(distortion, ray.x, ray.y);
    return {focal_px.x * x + centre_px.x, focal_px.y * y + centre_px.y};
  }

  // The inverse, by fixed-point steps: the ray (x, y, 1) behind a pixel position, to 1e-12 wherever
  // the distortion moves rays by less than a third of their distance from its centre.
  lightfield::Vec2 RayOf(lightfield::Vec2 pixel) const {
    const lightfield::Vec2 target{(pixel.x - centre_px.x) / focal_px.x,
                                  (pixel.y - centre_px.y) / focal_px.y};
    lightfield::Vec2 ray = target;
    for (int step = 0; step < 60; ++step) {
      const auto [x, y] = Distort(distortion, ray.x, ray.y);
      const lightfield::Vec2 off{target.x - x, target.y - y};
      ray = ray + off;
      if (std::abs(off.x) + std::abs(off.y) < 1e-13) break;
    }
    return ray;
  }

  // Pixel positions freed from distortion, where straight lines are straight, and back.
  lightfield::Vec2 Straight(lightfield::Vec2 pixel) const {
    const lightfield::Vec2 ray = RayOf(pixel);
    return {focal_px.x * ray.x + centre_px.x, focal_px.y * ray.y + centre_px.y};
  }
  lightfield::Vec2 Bent(lightfield::Vec2 straight) const {
    return PixelOf(
        {(straight.x - centre_px.x) / focal_px.x, (straight.y - centre_px.y) / focal_px.y});
  }
};

}  // namespace luxfield::rig
