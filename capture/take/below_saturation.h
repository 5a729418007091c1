// Frames of what does not move, each at the longest exposure that does not saturate.
#pragma once

#include <string>
#include <vector>

#include "luxfield/capture/take/frame_taker.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::capture {

// Takes a frame of `what` with the longest of the rising exposures ladder_s that keeps its
// brightest pixel below saturation_share of the range, and sets record.exposure_index. Throws
// InputError, naming `plan`, where even the shortest is too bright or the longest shows less than a
// tenth of the range.
Shot ShootBelowSaturation(FrameTaker& taker, const std::vector<double>& ladder_s,
                          double saturation_share, const rig::SensorModel& camera,
                          const std::string& plan, const std::string& what,
                          session::FrameRecord& record);

}  // namespace luxfield::capture
