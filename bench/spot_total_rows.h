// The total with the basis in it, against labs that measure lamps which no basis holds; rows of
// `bench budget` (bench_budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

constexpr const char* kTotalWithBasis = "total, with the basis";

// Every run is a lab of its own: 5 x 5 filters, all errors of the budget lab, and a spot lamp of
// its own, whose smallest possible spot the settings state. Deviations are from the lamp itself;
// predicted is the root mean square of the totals of the budgets of these very sessions.
nlohmann::json SpotTotalRows(const std::filesystem::path& folder, int runs, std::uint64_t seed,
                             bool dual);

}  // namespace luxfield::bench
