// {"quantities": [{"name", "unit", "value", "sigma", "relative", "sources": {name: sigma or
// null}}], "basis": "stated", "estimated" or null, "scale": {...}, "tilt": {...}}, the last two
// where they are there.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/reconstruct/budget/error_budget.h"

namespace luxfield::reconstruct {

nlohmann::json ToJson(const ErrorBudget& budget);

}  // namespace luxfield::reconstruct
