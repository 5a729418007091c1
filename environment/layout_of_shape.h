// The layout of an environment map that the shape of its picture tells
// (docs/formats/environment.md).
#pragma once

#include <optional>

#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// An unfolded cube, 3 : 4 or 4 : 3, of whole squares.
bool IsCross(int width, int height);

// Latitude-longitude for a picture twice as wide as high, cube for one six times as high as wide
// and for crosses; none for any other.
std::optional<EnvironmentLayout> LayoutOfShape(int width, int height);

}  // namespace luxfield::environment
