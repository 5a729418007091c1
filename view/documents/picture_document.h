// A picture from a file.
#pragma once

#include <filesystem>

#include "luxfield/view/documents/document.h"

namespace luxfield::view {

// Throws what ReadPicture throws.
std::unique_ptr<Document> OpenPicture(const std::filesystem::path& path);

}  // namespace luxfield::view
