// What missing_positions.h says against random lamps; rows of `bench budget` (bench_budget.h).
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

constexpr const char* kMissingSource = "missing positions";

// Lamps in the span of 7 x 7 filters (dual: pairs of `quadratic`): strengths even from 0 to 2 and
// independent from filter to filter, the same over I but for a beam. Texels on two sides of I miss
// a column and a row of filters, some a filter amidst them, one all of them. What is solved from
// the rest deviates from the lamp's closed forms, without any noise.
nlohmann::json MissingRows(int lamps, std::uint64_t seed, bool dual);

}  // namespace luxfield::bench
