// What a disk may hold after the power failed in the middle of a recorded run.
//
// The rules are POSIX's, not any file system's: a file's bytes are safe once the file was synced, a
// name in a folder once that folder was. Whatever was not synced may be there or not, each on its
// own; of bytes appended a part may be there, or zeros in their place. File systems promise more (a
// journal keeps the order of names), so what survives this survives them.
#pragma once

#include <filesystem>
#include <vector>

#include "luxfield/core/random.h"
#include "tests/storage/disk_calls.h"

namespace luxfield::disk {

// What becomes of what was not synced.
enum class Unsynced { kLost, kKept, kOnlyNamesKept, kOnlyBytesKept, kRandom };

// Makes `folder` (which exists and is empty) what the recorded root may be when the power fails
// after the first `count` calls.
void FailPower(const std::vector<Call>& calls, std::size_t count, Unsynced unsynced,
               core::Random& random, const std::filesystem::path& folder);

}  // namespace luxfield::disk
