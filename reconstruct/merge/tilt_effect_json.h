// TiltEffect as JSON: its fields under their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/reconstruct/merge/tilt_effect.h"

namespace luxfield::reconstruct {

nlohmann::json ToJson(const TiltEffect& effect);

}  // namespace luxfield::reconstruct
