#include "luxfield/capture/plan/capture_time.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace luxfield::capture {

int ReferenceCount(const Plan& plan, int positions) {
  const int every = plan.reference.every;
  return every > 0 ? (positions + every - 1) / every + 1 : 0;
}

StageTravel TravelOf(const ExpandedPlan& e, const hal::StageLimits& limits, hal::Vec2 from) {
  StageTravel travel;
  const auto go = [&](hal::Vec2 to) {
    const double way = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
    if (way > 0) travel.duration_s += way / limits.speed_m_per_s + limits.settle_s;
    travel.path_m += std::hypot(to.x - from.x, to.y - from.y);
    from = to;
  };
  const int every = e.plan.reference.every;
  for (std::size_t n = 0; n < e.positions.size(); ++n) {
    if (every > 0 && n % static_cast<std::size_t>(every) == 0) go(e.reference);
    go(e.positions[n].centre);
  }
  if (every > 0) go(e.reference);
  return travel;
}

FrameTimes MeasureFrameTimes(const hal::Devices& devices) {
  FrameTimes times{devices.camera->capabilities().readout_s, 0};
  if (devices.monitor) {
    const double start = devices.clock->MonotonicSeconds();
    devices.monitor->Read(start + 10);
    times.monitor_s = devices.clock->MonotonicSeconds() - start;
  }
  return times;
}

CaptureTime PredictCapture(const ExpandedPlan& e, std::span<const double> rates,
                           double reference_rate, const rig::SensorModel& calibration,
                           const FrameTimes& times, const StageTravel& travel) {
  const Plan& plan = e.plan;
  const auto& ladder = e.ladder_s;
  const ProbeWalk walk{static_cast<int>(ladder.size()) - 1, plan.exposure, calibration};
  const double around = times.readout_s + 2 * times.monitor_s;
  const auto probes_s = [&](double rate) {
    double sum = 0;
    for (std::optional<Probe> probe = walk.First(); probe;) {
      const double t = ladder[probe->rung];
      sum += t + around;
      probe =
          walk.Next(*probe, std::min(calibration.black_dn + rate * t, calibration.saturation_dn));
    }
    return sum;
  };

  CaptureTime result;
  const int rungs = static_cast<int>(ladder.size());
  const int references = ReferenceCount(plan, static_cast<int>(e.positions.size()));
  result.frames = 2 * plan.dark_repeats * rungs + references;
  result.duration_s =
      travel.duration_s +
      2 * plan.dark_repeats * (std::accumulate(ladder.begin(), ladder.end(), 0.0) + rungs * around);
  if (references > 0) {
    const int rung = ChooseRungs(reference_rate, ladder, plan.exposure, calibration).first;
    result.duration_s += probes_s(reference_rate) + references * (ladder[rung] + around);
  }
  for (const double rate : rates) {
    const Rungs& bracket =
        result.brackets.emplace_back(ChooseRungs(rate, ladder, plan.exposure, calibration));
    result.duration_s += probes_s(rate);
    for (int rung = bracket.first; rung <= bracket.last; ++rung)
      result.duration_s += plan.exposure.repeats * (ladder[rung] + around);
    result.frames += plan.exposure.repeats * (bracket.last - bracket.first + 1);
  }
  return result;
}

}  // namespace luxfield::capture
