// Some positions of a session to measurements.
#pragma once

#include <filesystem>

#include "luxfield/reconstruct/merge/merge_session.h"

namespace luxfield::reconstruct {

// The positions first to last - 1 of MergeSessionToFile alone (lightfield/file_pieces.h): frames of
// others are not read, those that all positions share are, and so are brackets whose levels are in
// doubt. Position by position the bytes of the whole.
void MergePositionsToFile(const session::SessionReader& session,
                          const std::filesystem::path& output, int first, int last,
                          const MergeSessionOptions& options = {},
                          MergeSessionSummary* summary = nullptr);

}  // namespace luxfield::reconstruct
