// A file or folder as a document, by what it is.
#pragma once

#include <filesystem>
#include <memory>

#include "luxfield/view/documents/document.h"
#include "luxfield/view/documents/scene_document.h"

namespace luxfield::view {

enum class InputKind { kScene, kLightField, kPicture, kSession };

// Throws InputError for what is absent, or nothing that can be looked at.
InputKind KindOfInput(const std::filesystem::path& file);

// Of what is lit; throws InputError for pictures and sessions too.
SceneKind KindToLight(const std::filesystem::path& file);

// A scene.toml, a light field, a picture or a session; what cannot be opened becomes a document that says why.
// With `wait` a session that is not there yet is waited for.
std::unique_ptr<Document> OpenInput(const SceneOptions& options, bool wait);

}  // namespace luxfield::view
