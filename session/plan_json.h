// plan.json as JSON (docs/formats/session.md, "plan.json").
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "luxfield/session/plan_file.h"

namespace luxfield::session {

nlohmann::json ToJson(const PlanFile& plan);
// Passes over keys that it does not know. Throws InputError naming file, field and value for what is
// there and wrong.
PlanFile PlanFromJson(const nlohmann::json& json, const std::string& file);

}  // namespace luxfield::session
