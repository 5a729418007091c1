// ReconstructionReport as JSON: its fields under their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/reconstruct/solve/report.h"

namespace luxfield::reconstruct {

nlohmann::json ToJson(const ReconstructionReport& report);

}  // namespace luxfield::reconstruct
