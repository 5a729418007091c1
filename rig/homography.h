// Projective maps of the plane.
//
//   (X, Y, W)^T = H (x, y, 1)^T,   (x, y) -> (X / W, Y / W)
//
// R. Hartley, A. Zisserman, "Multiple View Geometry in Computer Vision", 2nd ed. (2004), section 2.3.
#pragma once

#include <array>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::rig {

// X, Y, W above.
struct Homogeneous {
  double x = 0, y = 0, w = 1;
};

// d(mapped) / d(x) and d(mapped) / d(y).
struct PlaneDerivative {
  lightfield::Vec2 by_x, by_y;
};

class Homography {
 public:
  Homography() = default;  // the identity
  Homography(const std::array<double, 9>& row_major) : h_(row_major) {}

  // The map that takes the corners (0, 0), (width, 0), (width, height), (0, height) to the four
  // points, in that order. Throws InputError if three of the points lie on a line.
  static Homography FromCorners(double width, double height,
                                const std::array<lightfield::Vec2, 4>& points);

  const std::array<double, 9>& row_major() const { return h_; }
  double operator()(int row, int column) const {
    return h_[3 * static_cast<std::size_t>(row) + static_cast<std::size_t>(column)];
  }
  // As numbers, not as maps: multiples of a matrix map points alike.
  bool operator==(const Homography&) const = default;

  Homogeneous Lift(lightfield::Vec2 p) const {
    return {h_[0] * p.x + h_[1] * p.y + h_[2], h_[3] * p.x + h_[4] * p.y + h_[5],
            h_[6] * p.x + h_[7] * p.y + h_[8]};
  }
  // Not finite where W = 0: the point lies on the map's vanishing line.
  lightfield::Vec2 Map(lightfield::Vec2 p) const {
    const Homogeneous q = Lift(p);
    return {q.x / q.w, q.y / q.w};
  }

  //   d(X/W) / dx = (h00 - (X/W) h20) / W   and so on
  PlaneDerivative Derivative(lightfield::Vec2 p) const;
  // How much the map enlarges areas, negative where it mirrors them:
  //   det H / W^3
  double AreaFactor(lightfield::Vec2 p) const;

  double Determinant() const;
  // The determinant is 0 to within what rounding makes of it, or not finite.
  bool Singular() const;
  // Throws InputError if the map is singular.
  Homography Inverse() const;
  // The inverse times the determinant, which maps points as the inverse does.
  Homography Adjugate() const;
  // Divided by its last element, where that is not 0.
  Homography Normalised() const;

 private:
  std::array<double, 9> h_{1, 0, 0, 0, 1, 0, 0, 0, 1};
};

// b first, then a.
Homography operator*(const Homography& a, const Homography& b);

}  // namespace luxfield::rig
