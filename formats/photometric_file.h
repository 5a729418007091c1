// Photometric files of every kind by their content.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// LM-63, EULUMDAT, TM-33 or GLDF, whatever the name's ending. Throws InputError as the parsers do.
Photometry ReadPhotometry(const std::filesystem::path& path);

// The same of bytes, no container among them; `file` is for messages.
Photometry ParsePhotometry(std::string_view text, const std::string& file);

}  // namespace luxfield::formats
