// EdgeLight as JSON: its fields under their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/lightfield/edge_light.h"

namespace luxfield::lightfield {

nlohmann::json ToJson(const EdgeLight& edges);

}  // namespace luxfield::lightfield
