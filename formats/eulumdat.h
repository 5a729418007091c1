// EULUMDAT, *.ldt (docs/formats/photometric-files.md).
#pragma once

#include <string>
#include <string_view>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// `file` is for messages. Throws InputError naming file, line and field.
Photometry ParseEulumdat(std::string_view text, const std::string& file);

// The file's text, ISO-8859-1 with CR LF; intensities are cd per 1000 lm of the luminaire's flux
// (absolute photometry, which a negative number of lamps marks) or of the lamps', with seven
// significant digits. Throws InputError naming `file` for what the format cannot hold: types A and
// B, a table without flux.
std::string FormatEulumdat(const Photometry& photometry, const std::string& file);

}  // namespace luxfield::formats
