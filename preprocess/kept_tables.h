// Tables of a light field that were built before, from the cache (core/cache.h); else built, and
// kept. The same to the bit either way.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "luxfield/preprocess/cell_tables.h"
#include "luxfield/preprocess/light_vector_volume.h"
#include "luxfield/preprocess/tables.h"

namespace luxfield::preprocess {

// What a light field is known by: the file that it was read from.
struct FieldOrigin {
  std::string file;    // for messages
  std::string sha256;  // of its bytes, and behind it the name of the field in a file of several
};

// Gives the light field; asked where a table is not kept, and once then.
using FieldSource = std::function<lightfield::LightField()>;

// BuildTables.
Tables KeptTables(const FieldSource& field, const FieldOrigin& origin);
// BuildCellTables.
CellTables KeptCellTables(const FieldSource& field, const FieldOrigin& origin);
// BuildForReceivers. A volume that does not meet its error is not kept.
VolumeForError KeptVolume(const lightfield::FieldColumns& field, const FieldOrigin& origin,
                          std::span<const Receiver> receivers, const VolumeOptions& options);

}  // namespace luxfield::preprocess
