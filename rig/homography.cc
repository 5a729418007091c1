#include "luxfield/rig/homography.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "luxfield/core/error.h"

namespace luxfield::rig {

using lightfield::Vec2;

// P. Heckbert, "Fundamentals of Texture Mapping and Image Warping" (1989), section 2.2.3: unit
// square to quadrilateral.
Homography Homography::FromCorners(double width, double height, const std::array<Vec2, 4>& p) {
  const Vec2 d1 = p[1] - p[2], d2 = p[3] - p[2], sum = p[0] - p[1] + p[2] - p[3];
  const double det = d1.x * d2.y - d2.x * d1.y;
  const double g = (sum.x * d2.y - d2.x * sum.y) / det, h = (d1.x * sum.y - sum.x * d1.y) / det;
  const Homography map({(p[1].x - p[0].x + g * p[1].x) / width,
                        (p[3].x - p[0].x + h * p[3].x) / height, p[0].x,
                        (p[1].y - p[0].y + g * p[1].y) / width,
                        (p[3].y - p[0].y + h * p[3].y) / height, p[0].y, g / width, h / height, 1});
  if (map.Singular())
    throw InputError(
        fmt::format("three of the corners ({}, {}), ({}, {}), ({}, {}), ({}, {}) lie "
                    "on a line; give those of a quadrilateral",
                    p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y, p[3].x, p[3].y));
  return map;
}

PlaneDerivative Homography::Derivative(Vec2 p) const {
  const Homogeneous q = Lift(p);
  const Vec2 at{q.x / q.w, q.y / q.w};
  return {{(h_[0] - at.x * h_[6]) / q.w, (h_[3] - at.y * h_[6]) / q.w},
          {(h_[1] - at.x * h_[7]) / q.w, (h_[4] - at.y * h_[7]) / q.w}};
}

double Homography::AreaFactor(Vec2 p) const {
  const double w = Lift(p).w;
  return Determinant() / (w * w * w);
}

double Homography::Determinant() const {
  const auto& h = h_;
  return h[0] * (h[4] * h[8] - h[5] * h[7]) - h[1] * (h[3] * h[8] - h[5] * h[6]) +
         h[2] * (h[3] * h[7] - h[4] * h[6]);
}

// A determinant of 3 x 3 is a sum of six products of three numbers. Each of the five roundings that
// a product sees errs by half an epsilon of the products' sizes.
bool Homography::Singular() const {
  std::array<double, 9> size{};
  std::transform(h_.begin(), h_.end(), size.begin(), [](double x) { return std::abs(x); });
  const double products = size[0] * (size[4] * size[8] + size[5] * size[7]) +
                          size[1] * (size[3] * size[8] + size[5] * size[6]) +
                          size[2] * (size[3] * size[7] + size[4] * size[6]);
  return !(std::abs(Determinant()) > 2.5 * std::numeric_limits<double>::epsilon() * products) ||
         !std::isfinite(products);
}

Homography Homography::Inverse() const {
  if (Singular())
    throw InputError(fmt::format(
        "the homography [{}, {}, {}; {}, {}, {}; {}, {}, {}] is singular and has no inverse; "
        "measure it again",
        h_[0], h_[1], h_[2], h_[3], h_[4], h_[5], h_[6], h_[7], h_[8]));
  Homography inverse = Adjugate();
  const double determinant = Determinant();
  for (double& value : inverse.h_) value /= determinant;
  return inverse;
}

Homography Homography::Adjugate() const {
  const auto& h = h_;
  return Homography(
      {h[4] * h[8] - h[5] * h[7], h[2] * h[7] - h[1] * h[8], h[1] * h[5] - h[2] * h[4],
       h[5] * h[6] - h[3] * h[8], h[0] * h[8] - h[2] * h[6], h[2] * h[3] - h[0] * h[5],
       h[3] * h[7] - h[4] * h[6], h[1] * h[6] - h[0] * h[7], h[0] * h[4] - h[1] * h[3]});
}

Homography Homography::Normalised() const {
  Homography map = *this;
  const double last = h_[8] == 0 ? 1 : h_[8];
  for (double& value : map.h_) value /= last;
  return map;
}

Homography operator*(const Homography& a, const Homography& b) {
  std::array<double, 9> c{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) c[static_cast<std::size_t>(3 * i + j)] += a(i, k) * b(k, j);
  return Homography(c);
}

}  // namespace luxfield::rig
