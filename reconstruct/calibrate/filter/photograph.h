// A linear photograph with its error: what `filter measure` takes (docs/formats/filter.md,
// "Photographs").
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"

namespace luxfield::reconstruct {

// As MergeExposures gives it; a mask of kSaturated or kDefect is an unknown pixel. Reading throws
// InputError for a file that is no such photograph.
void WritePhotograph(const std::filesystem::path& path, const MergedFrame& photograph);
MergedFrame ReadPhotograph(const std::filesystem::path& path);

}  // namespace luxfield::reconstruct
