// The photographs that `filter measure` needs, taken on a simulated lab's bench: bracketed, merged.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "hal/sim/filter_bench.h"
#include "lightfield/filter_sheet.h"
#include "reconstruct/merge_exposures.h"

namespace luxfield::study {

struct FilterPhotographs {
  lightfield::FilterSheet sheet;
  reconstruct::MergedFrame light;
  std::vector<reconstruct::MergedFrame> prints;  // 1, or plus and minus
};

// 1, 8 and 64 times the exposure that the bare light asks for, four frames each (of the light alone
// only the first), four darks of every time; merged with the camera's noise model.
FilterPhotographs PhotographFilter(const hal::sim::FilterBench& bench);

// For a lab.toml; `seed` replaces the file's, `pixels` are the photographs' side.
FilterPhotographs PhotographFilter(const std::filesystem::path& lab_toml,
                                   std::optional<std::uint64_t> seed, int pixels);

}  // namespace luxfield::study
