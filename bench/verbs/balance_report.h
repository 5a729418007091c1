// The rows of `luxfield bench balance` as CSV and as a plot.
#pragma once

#include <filesystem>
#include <vector>

#include "luxfield/core/json.h"

namespace luxfield::bench {

// Writes balance.csv, search.csv (where there was one), claims.csv and balance.svg: for each scene
// the efficiency of every strategy over that of the balance heuristic. Returns the files.
std::vector<std::filesystem::path> WriteBalance(const core::Json& result,
                                                const std::filesystem::path& folder);

}  // namespace luxfield::bench
