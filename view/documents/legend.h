// What false colours mean.
#pragma once

#include "luxfield/view/picture/layer.h"

namespace luxfield::view {

// Into the ImGui window that is begun: a bar from the lowest value on the left to the highest, with
// ticks, and labels where these have room.
void DrawLegend(const render::FalseColourScale& scale, Layer layer);

}  // namespace luxfield::view
