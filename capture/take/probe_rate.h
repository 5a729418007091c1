// How bright a place is, from frames that only serve to find it.
#pragma once

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/take/frame_taker.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::capture {

// Brightest signal in DN per second where the stage stands, by a walk over the ladder (ProbeWalk);
// the journal's `probe`. `place` names the frames there.
double ProbeRate(FrameTaker& taker, const session::FrameRecord& place, const ExpandedPlan& expanded,
                 const rig::SensorModel& calibration);

}  // namespace luxfield::capture
