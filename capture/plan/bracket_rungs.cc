#include "luxfield/capture/plan/bracket_rungs.h"

#include <algorithm>
#include <cmath>

namespace luxfield::capture {

Rungs ChooseRungs(double rate, const std::vector<double>& ladder_s, const ExposurePolicy& policy,
                  const rig::SensorModel& c) {
  const int top = static_cast<int>(ladder_s.size()) - 1;
  Rungs rungs;
  const double room = policy.saturation_share * c.saturation_dn - c.black_dn;
  while (rungs.first < top && rate * ladder_s[rungs.first + 1] <= room) ++rungs.first;
  rungs.last = rungs.first;
  const double needed = policy.floor_sigmas * c.read_noise_dn;
  while (rungs.last < top && policy.relevant_share * rate * ladder_s[rungs.last] < needed)
    ++rungs.last;
  return rungs;
}

std::optional<Probe> ProbeWalk::Next(const Probe& probe, double brightest_dn) const {
  const rig::SensorModel& c = calibration;
  if (brightest_dn >= policy.saturation_share * c.saturation_dn)
    return probe.rung > 0 ? std::optional(Probe{probe.rung - 1, true}) : std::nullopt;
  const double dim =
      c.black_dn + std::max(20 * c.read_noise_dn, 0.02 * (c.saturation_dn - c.black_dn));
  if (!probe.came_down && brightest_dn < dim && probe.rung < top)
    return Probe{probe.rung + 1, false};
  return std::nullopt;
}

}  // namespace luxfield::capture
