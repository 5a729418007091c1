// Comma-separated values.
#pragma once

#include <string>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// A line of the first row's keys, then a line a row. Empty without rows. All rows must have the same
// keys.
std::string Csv(const core::Json& rows);

// A field that is text and no number: quoted where it must be (RFC 4180), shown as core::Visible does
// (a lone CR as \x0d), an apostrophe before what spreadsheets would evaluate: text that begins with an
// equals sign, a plus, a minus, an @ or a tab (OWASP, "CSV Injection").
std::string CsvText(const std::string& text);

}  // namespace luxfield::cli
