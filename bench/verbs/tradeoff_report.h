// The rows of `luxfield bench tradeoff` as CSV and as plots.
#pragma once

#include <filesystem>
#include <vector>

#include "luxfield/core/json.h"

namespace luxfield::bench {

// Writes tradeoff.csv, and for each scene, kind of shadows and surface
// SCENE-shadows-ON|OFF-SURFACE.svg: relative RMSE over core-seconds, both logarithmic, a colour and
// marker per estimator, a line per setting of its knobs, rings on the Pareto front. Returns the
// files.
std::vector<std::filesystem::path> WriteTradeoff(const core::Json& rows,
                                                 const std::filesystem::path& folder);

}  // namespace luxfield::bench
