// The budget of filters as measured against photographs with their own noise; rows of `bench
// budget` (bench_budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::study {

constexpr const char* kFilterSource = "measured filter";

// One session without noise through a print that sits 0.2 mm beside its place, 2 % off in density.
// Every run photographs the print anew, on a bench that stands otherwise, and reconstructs with
// what `filter measure` makes of it. `predicted` are filter noise, print shift and density of the
// budget together, mean square over `budgets` runs; `observed` is the deviation from what a
// perfect print would have shown.
nlohmann::json FilterRows(const std::filesystem::path& folder, int runs, int budgets,
                          std::uint64_t seed);

}  // namespace luxfield::study
