// How the picture is shown: the tone operator and its numbers, or false colours with their legend.
#pragma once

#include "luxfield/view/picture/look.h"

namespace luxfield::view {

// Draws into the ImGui window that is begun, and changes `look` as it is told. `scale` is what false
// colours span now; `offers_feedback`: layers of it can be chosen though `sources` do not have them yet.
void DrawLookPanel(const render::Frame& frame, const render::FalseColourScale& scale,
                   const LayerSources& sources, bool offers_feedback, Look& look);

}  // namespace luxfield::view
