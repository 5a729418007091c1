#include "luxfield/capture/take/probe_rate.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace luxfield::capture {

double ProbeRate(FrameTaker& taker, const session::FrameRecord& place, const ExpandedPlan& expanded,
                 const rig::SensorModel& calibration) {
  const ProbeWalk walk{static_cast<int>(expanded.ladder_s.size()) - 1, expanded.plan.exposure,
                       calibration};
  for (Probe probe = walk.First();;) {
    taker.Configure(probe.rung);
    const Shot shot = taker.Shoot(place);
    const FrameStatistics& s = shot.statistics;
    taker.Note("probe", {{"i", place.i},
                         {"j", place.j},
                         {"print", place.print},
                         {"channel", place.channel},
                         {"exposure_s", taker.exposure_s()},
                         {"brightest_dn", s.brightest_dn},
                         {"saturated_share", s.saturated_share}});
    const auto next = walk.Next(probe, s.brightest_dn);
    if (!next) return std::max(0.0, s.brightest_dn - calibration.black_dn) / taker.exposure_s();
    probe = *next;
  }
}

}  // namespace luxfield::capture
