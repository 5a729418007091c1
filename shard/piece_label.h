// The line that a file of a piece ends with: which file of which shard it is.
//
//   luxfield-piece 0007-HASH.sigma.exr of reconstruct, rows 12 to 23, figures HASH
//
// Readers of OpenEXR and PNG pass over what follows their last chunk, so that a piece is a picture
// like any other. What the pieces are joined to has no such line.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/core/json.h"
#include "luxfield/shard/job_folder.h"

namespace luxfield::shard {

// The line of the file called `name`, without its newlines; `figures` are those of the shard's
// manifest.
std::string LabelOf(const Job& job, const PlannedShard& shard, const std::string& name,
                    const core::Json& figures);

// Appends it, between newlines. Throws DeviceError.
void AddLabel(const std::filesystem::path& file, const std::string& label);
// The file's; empty where it has none. Throws InputError where it cannot be read.
std::string FindLabel(const std::filesystem::path& file);
// Cuts the file's off, if it has one.
void RemoveLabel(const std::filesystem::path& file);

}  // namespace luxfield::shard
