// A file or folder as a document, by what it is.
#pragma once

#include <memory>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/documents/scene_document.h"

namespace luxfield::view {

// A scene.toml, a light field, a picture or a session; what cannot be opened becomes a document that says why.
std::unique_ptr<Document> OpenInput(const SceneOptions& options);

}  // namespace luxfield::view
