// The photographs that `filter measure` needs, taken on a simulated lab's bench: bracketed, merged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "luxfield/hal/sim/filter_bench.h"
#include "luxfield/reconstruct/calibrate/filter/filter_session.h"

namespace luxfield::planning {

using reconstruct::FilterPhotographs;

// 1, 8 and 64 times the exposure that the bare light asks for, four frames each (of the light alone
// only the first), four darks of every time; merged with the camera's noise model.
FilterPhotographs PhotographFilter(const hal::sim::FilterBench& bench);

// For a lab.toml; `seed` replaces the file's, `pixels` are the photographs' side.
FilterPhotographs PhotographFilter(const std::filesystem::path& lab_toml,
                                   std::optional<std::uint64_t> seed, int pixels);

}  // namespace luxfield::planning
