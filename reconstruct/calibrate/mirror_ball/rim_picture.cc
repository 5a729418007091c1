#include "luxfield/reconstruct/calibrate/mirror_ball/rim_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/core/colour.h"

namespace luxfield::reconstruct {
namespace {

void Mark(core::Image& picture, double x, double y, int side, const core::Rgb& colour) {
  const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
  for (int r = row; r < row + side; ++r)
    for (int c = column; c < column + side; ++c)
      if (r >= 0 && c >= 0 && r < picture.height && c < picture.width)
        for (int k = 0; k < 3; ++k) picture.at(k, r, c) = static_cast<float>(colour[k]);
}

}  // namespace

core::Image DrawRim(const core::Image& radiance, const RimFit& rim) {
  std::vector<float> values = radiance.data;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double grey = std::max(2.0 * *middle, 1e-30);
  core::Image picture(radiance.width, radiance.height, 3);
  for (int k = 0; k < 3; ++k) {
    const auto from = radiance.plane(std::min(k, radiance.channels - 1));
    std::transform(from.begin(), from.end(), picture.plane(k).begin(), [grey](float x) {
      return static_cast<float>(std::max(x, 0.0f) / (std::max(x, 0.0f) + grey));
    });
  }
  // Drawn as a circle also where perspective makes an ellipse of it.
  const int steps = static_cast<int>(8 * rim.circle.radius) + 8;
  for (int k = 0; k < steps; ++k) {
    const double angle = 2 * std::numbers::pi * k / steps;
    Mark(picture, rim.circle.x + rim.circle.radius * std::cos(angle),
         rim.circle.y + rim.circle.radius * std::sin(angle), 1, {1, 0.8, 0});
  }
  for (const RimPoint& point : rim.points)
    if (point.seen)
      Mark(picture, point.p.x, point.p.y, 2,
           point.on_rim ? core::Rgb{0, 1, 0} : core::Rgb{1, 0, 0});
  return picture;
}

}  // namespace luxfield::reconstruct
