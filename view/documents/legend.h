// What false colours mean.
#pragma once

#include <imgui.h>

#include "luxfield/view/picture/layer.h"

namespace luxfield::view {

// Into the ImGui window that is begun: a bar from the lowest value on the left to the highest, with
// ticks below it.
void DrawLegend(const render::FalseColourScale& scale, Layer layer);

// Ticks and labels (view/picture/ticks.h) below a line that begins at `at`; how high they are.
float DrawTicks(const render::FalseColourScale& scale, Layer layer, ImVec2 at, float width);

}  // namespace luxfield::view
