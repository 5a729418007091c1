// MergeSessionSummary as JSON: its fields under their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::reconstruct {

nlohmann::json ToJson(const MergeSessionSummary& summary);

}  // namespace luxfield::reconstruct
