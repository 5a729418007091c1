// How long a capture takes where it is known how bright every image is: what DryRun bounds.
//
//   darks       2 dark_repeats frames of every rung
//   position    the stage's way and its settling, probe frames, then the bracket's rungs `repeats`
//               times, per print and channel
//   reference   the way there, one frame per channel; probe frames before the first
//
// with the rungs and probes that RunCapture chooses (frame_check.h). A frame takes its exposure,
// the read-out and two readings of the lamp monitor. Homing, warm-up, changes of prints and colours
// and frames taken again are not in it.
#pragma once

#include <span>
#include <vector>

#include "luxfield/capture/plan/bracket_rungs.h"
#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::capture {

// Of every `every` positions the first follows a reference frame, and one ends the session.
int ReferenceCount(const Plan& plan, int positions);

struct StageTravel {
  double path_m = 0, duration_s = 0;
};
// Through all positions and references, from where the stage stands.
StageTravel TravelOf(const ExpandedPlan& expanded, const hal::StageLimits& limits, hal::Vec2 from);

struct FrameTimes {
  double readout_s = 0;
  double monitor_s = 0;  // one reading of the lamp monitor
};
// Reads the monitor once, on the rig's clock.
FrameTimes MeasureFrameTimes(const hal::Devices& devices);

struct CaptureTime {
  int frames = 0;  // that are kept
  double duration_s = 0;
  std::vector<Rungs> brackets;  // one per rate
};

// `rate_dn_per_s`: signal of the brightest pixel of every bracket, in the order of the positions,
// and of each the prints of a single channel. `reference_rate_dn_per_s`: of the reference position.
CaptureTime PredictCapture(const ExpandedPlan& expanded, std::span<const double> rate_dn_per_s,
                           double reference_rate_dn_per_s, const rig::SensorModel& calibration,
                           const FrameTimes& times, const StageTravel& travel);

}  // namespace luxfield::capture
