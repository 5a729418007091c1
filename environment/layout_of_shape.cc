#include "luxfield/environment/layout_of_shape.h"

namespace luxfield::environment {

bool IsCross(int width, int height) {
  return (3 * height == 4 * width && width % 3 == 0) || (4 * height == 3 * width && width % 4 == 0);
}

std::optional<EnvironmentLayout> LayoutOfShape(int width, int height) {
  if (width == 2 * height) return EnvironmentLayout::kLatitudeLongitude;
  if (height == 6 * width || IsCross(width, height)) return EnvironmentLayout::kCube;
  return {};
}

}  // namespace luxfield::environment
