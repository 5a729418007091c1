// Photometric files of every kind by their content.
#pragma once

#include <filesystem>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// LM-63, EULUMDAT or TM-33, whatever the name's ending. Throws InputError as the parsers do.
Photometry ReadPhotometry(const std::filesystem::path& path);

}  // namespace luxfield::formats
