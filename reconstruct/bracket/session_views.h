// Frames of a calibration session's views, merged with the darks of their exposure times.
#pragma once

#include <map>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/session_store.h"

namespace luxfield::reconstruct {

// Frames of kind `target` by the number of their view.
std::map<int, std::vector<const session::FrameRecord*>> FramesByView(
    const session::SessionReader& session);

// The frames of one view, with the mean of the session's darks of each exposure time.
MergedFrame MergeView(const session::SessionReader& session,
                      const std::vector<const session::FrameRecord*>& records,
                      const rig::SensorModel& sensor, bool check_hashes);

}  // namespace luxfield::reconstruct
