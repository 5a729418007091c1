// What `luxfield info` says of a luminaire's planes and images.
#pragma once

#include "luxfield/core/json.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::cli {

void PrintGeometry(const lightfield::LuminaireGeometry& geometry);
core::Json GeometryJson(const lightfield::LuminaireGeometry& geometry);

}  // namespace luxfield::cli
