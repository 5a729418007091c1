// The budget of filters as measured against photographs with their own noise; rows of `bench
// budget` (bench_budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

constexpr const char* kFilterSource = "measured filter";

// One session without noise through a print that sits 0.2 mm beside its place, 2 % off in density,
// or through a pair in its place. Every run photographs the print anew, on a bench that stands
// otherwise, and reconstructs with what `filter measure` makes of it. What comes out is compared
// with what a perfect print would have shown to the same camera, whose rounding is not the
// filter's; `predicted` is what the budget states of the filter together, mean square over
// `budgets` runs:
//   "measured filter"               filter noise, print shift and density (the level); `observed`
//                                   is the root mean square of the deviations
//   "measured filter, level known"  filter noise and print shift; T is put to the level of the
//                                   light that the simulated bench had; `observed` is the standard
//                                   deviation about the runs' mean, and `bias` that mean, a share
//                                   of the value: what noise in the denominator, holes in uneven
//                                   light and the lab's quadrature do alike in all runs
nlohmann::json FilterRows(const std::filesystem::path& folder, int runs, int budgets,
                          std::uint64_t seed, bool dual);

}  // namespace luxfield::bench
