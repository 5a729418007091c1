#include "luxfield/rig/homography.h"

namespace luxfield::rig {

// P. Heckbert, "Fundamentals of Texture Mapping and Image Warping" (1989), section 2.2.3: unit
// square to quadrilateral.
Homography FromCorners(double width, double height, const std::array<lightfield::Vec2, 4>& p) {
  const lightfield::Vec2 d1 = p[1] - p[2], d2 = p[3] - p[2], sum = p[0] - p[1] + p[2] - p[3];
  const double det = d1.x * d2.y - d2.x * d1.y;
  const double g = (sum.x * d2.y - d2.x * sum.y) / det, h = (d1.x * sum.y - sum.x * d1.y) / det;
  return {(p[1].x - p[0].x + g * p[1].x) / width,
          (p[3].x - p[0].x + h * p[3].x) / height,
          p[0].x,
          (p[1].y - p[0].y + g * p[1].y) / width,
          (p[3].y - p[0].y + h * p[3].y) / height,
          p[0].y,
          g / width,
          h / height,
          1};
}

}  // namespace luxfield::rig
