// Rows of a bench as comma-separated values.
#pragma once

#include <string>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// A line of the first row's keys, then a line a row; fields with a comma or a quote are quoted (RFC
// 4180). Empty without rows. All rows must have the same keys.
std::string Csv(const core::Json& rows);

// Quoted where it must be.
std::string CsvCell(const std::string& text);

}  // namespace luxfield::cli
