// luxfield info of photometric files.
#pragma once

#include <string>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// Prints what an LM-63 or EULUMDAT file is: its flux by the header and by integration, its peak,
// opening, symmetry and what is odd about it.
core::Json InfoPhotometry(const std::string& path);

}  // namespace luxfield::cli
