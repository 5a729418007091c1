// Which exposures a bracket needs (docs/lab.md, "Exposure brackets").
#pragma once

#include <optional>
#include <vector>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/hal/devices.h"

namespace luxfield::capture {

// The rungs of a bracket: from the longest exposure that keeps the brightest pixel below
// saturation_share, to the first one that lifts every pixel that matters (relevant_share of the
// brightest) floor_sigmas read noises above black. `rate_dn_per_s` is the brightest pixel's signal.
struct Rungs {
  int first = 0, last = 0;
};
Rungs ChooseRungs(double rate_dn_per_s, const std::vector<double>& ladder_s,
                  const ExposurePolicy& policy, const rig::SensorModel& calibration);

// Frames that find how bright a place is, before its bracket: from the middle of the ladder down
// while anything is saturated, up while nothing stands out of the noise.
struct Probe {
  int rung = 0;
  bool came_down = false;
};
struct ProbeWalk {
  int top = 0;  // the ladder's last rung
  const ExposurePolicy& policy;
  const rig::SensorModel& calibration;

  Probe First() const { return {top / 2, false}; }
  // After a frame with this brightest pixel; nothing: it is good enough.
  std::optional<Probe> Next(const Probe& probe, double brightest_dn) const;
};

}  // namespace luxfield::capture
