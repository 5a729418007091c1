// RayImportReport as JSON: its fields under their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/reconstruct/solve/import_rays.h"

namespace luxfield::reconstruct {

nlohmann::json ToJson(const RayImportReport& report);

}  // namespace luxfield::reconstruct
