// Frames of a calibration session's views, merged with the darks of their exposure times.
#pragma once

#include <map>
#include <vector>

#include "core/session_store.h"
#include "reconstruct/merge_exposures.h"

namespace luxfield::reconstruct {

// Frames of kind `target` by the number of their view.
std::map<int, std::vector<const core::FrameRecord*>> FramesByView(
    const core::SessionReader& session);

// The frames of one view, with the mean of the session's darks of each exposure time.
MergedFrame MergeView(const core::SessionReader& session,
                      const std::vector<const core::FrameRecord*>& records,
                      const SensorModel& sensor, bool check_hashes);

}  // namespace luxfield::reconstruct
