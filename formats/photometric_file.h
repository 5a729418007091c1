// Photometric files of every kind by their content.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "luxfield/formats/l3d.h"
#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// LM-63, EULUMDAT, TM-33 or GLDF, whatever the name's ending. Throws InputError as the parsers do.
Photometry ReadPhotometry(const std::filesystem::path& path);

// The shape of an L3D file, or of the first L3D in a GLDF container; none of a container without
// one and of files that are no archives.
std::optional<LampShape> ReadLampShape(const std::filesystem::path& path);

// The photometry of bytes, no container among them; `file` is for messages.
Photometry ParsePhotometry(std::string_view text, const std::string& file);

}  // namespace luxfield::formats
