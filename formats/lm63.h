// IES LM-63 (docs/formats/photometric-files.md): files of 1986, 1991, 1995, 2002 and 2019.
#pragma once

#include <string>
#include <string_view>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// `file` is for messages. Throws InputError naming file, line and field.
Photometry ParseLm63(std::string_view text, const std::string& file);

enum class Lm63Version { k2002, k2019 };

// The file's text, as absolute photometry: CR LF, lines of at most 132 characters, values of six
// significant digits, planes as the symmetry of the table allows. Throws InputError naming `file`
// for what the format cannot hold.
std::string FormatLm63(const Photometry& photometry, Lm63Version version, const std::string& file);

}  // namespace luxfield::formats
