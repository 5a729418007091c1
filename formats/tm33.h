// ANSI/IES TM-33, an XML format (docs/formats/photometric-files.md): files of TM-33-18 and TM-33-23,
// and of ATLA S001, from which they come.
#pragma once

#include <string>
#include <string_view>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

// `file` is for messages. Throws InputError naming file and line or field.
Photometry ParseTm33(std::string_view text, const std::string& file);

// The file's text, TM-33-23, seven significant digits; the opening as an area of the bottom face.
// ReportDate, which the format asks for, is the keyword ISSUEDATE where that is a date like
// 2024-06-21, else 0001-01-01. Keywords that it has no element for become comments "KEY: text".
// Throws InputError naming `file` for what the format cannot hold.
std::string FormatTm33(const Photometry& photometry, const std::string& file);

}  // namespace luxfield::formats
