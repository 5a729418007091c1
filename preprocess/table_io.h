// *.tab.exr, to the byte in docs/formats/tables.md.
#pragma once

#include <filesystem>

#include "luxfield/preprocess/tables.h"

namespace luxfield::preprocess {

// Writes atomically, uncompressed (a SAT shrinks by a third and takes 20 times as long). Equal
// tables give equal bytes. Throws DeviceError.
void WriteTables(const std::filesystem::path& path, const Tables& tables);

// Throws InputError naming file and part for a missing, truncated, wrong-type, wrong-version or
// inconsistent file, and for one whose SAT is not that of non-negative texels, so that no search on
// a device can leave its image.
Tables ReadTables(const std::filesystem::path& path);

}  // namespace luxfield::preprocess
