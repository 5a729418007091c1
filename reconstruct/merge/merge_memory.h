// What a merge of a session takes of memory, whatever the number of its positions.
#pragma once

#include <cstdint>

#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::reconstruct {

// Bytes that MergeSessionToFile has in memory at once beside the program, at most: two brackets and
// the bytes of one's files, the means of dark frames, planes of the sensor, and one position's planes
// of texels. Throws InputError as CalibratedPlan.
std::uint64_t MergeBytes(const session::SessionReader& session, const MergeSessionOptions& options);

}  // namespace luxfield::reconstruct
