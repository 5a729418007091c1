// Values with their standard uncertainties in JSON: KEY and KEY_u, null where there is none.
#pragma once

#include <optional>
#include <string>

#include "luxfield/core/json.h"
#include "luxfield/photometry/functional.h"

namespace luxfield::cli {

inline core::Json OptionalJson(const std::optional<double>& value) {
  return value ? core::Json(*value) : core::Json();
}

inline void PutEstimate(core::Json& json, const std::string& key,
                        const std::optional<photometry::Estimate>& estimate) {
  json[key] = estimate ? core::Json(estimate->value) : core::Json();
  json[key + "_u"] = estimate ? OptionalJson(estimate->u) : core::Json();
}

inline core::Json VectorJson(lightfield::Vec3 v) { return {v.x, v.y, v.z}; }

// A list for each row, the first row first.
inline core::Json RowsJson(const std::vector<double>& values, int columns) {
  core::Json rows = core::Json::array();
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (k % static_cast<std::size_t>(columns) == 0) rows.push_back(core::Json::array());
    rows.back().push_back(values[k]);
  }
  return rows;
}

}  // namespace luxfield::cli
