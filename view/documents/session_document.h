// A session, being captured or done, as a map of its positions.
#pragma once

#include <filesystem>
#include <memory>

#include "luxfield/view/documents/document.h"

namespace luxfield::view {

// Throws what SessionWatch throws.
std::unique_ptr<Document> OpenSession(const std::filesystem::path& folder, bool wait);

}  // namespace luxfield::view
