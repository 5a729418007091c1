// luxfield info of photometric files.
#pragma once

#include <string>

#include "luxfield/core/json.h"

namespace luxfield::cli {

// Prints what a photometric file is: its flux by the header and by integration, its peak, opening,
// symmetry and what is odd about it; of a GLDF container also where its L3D shines.
core::Json InfoPhotometry(const std::string& path);

// Prints where a luminaire of an L3D file shines.
core::Json InfoLampShape(const std::string& path);

}  // namespace luxfield::cli
