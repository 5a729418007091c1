// A scene that is lit while it is looked at.
#pragma once

#include <memory>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/lighting/load_scene.h"

namespace luxfield::view {

// Loads in the background; what is wrong with the file is the document's failure().
// The stage has a slider for its distance.
std::unique_ptr<Document> OpenScene(const SceneOptions& options, SceneKind kind);

}  // namespace luxfield::view
