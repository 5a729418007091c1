#include "luxfield/capture/plan/glare_plan.h"

#include <fmt/format.h>

#include <numeric>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"

namespace luxfield::capture {

GlarePlan ReadGlarePlan(const core::Config& config) {
  GlarePlan plan;
  ReadTargetPlan(config, PlanKind::kGlare, "measures the veiling glare", plan);
  plan.places = config.Table("plan").Integer("places", plan.places, 1, 100);
  plan.repeats = config.Table("exposure").Integer("repeats", plan.repeats, 1, 1000);
  config.Finish();
  return plan;
}

ExpandedGlarePlan ExpandPlan(const GlarePlan& plan, const hal::Devices& devices) {
  const std::string what = fmt::format("plan \"{}\"", plan.name);
  const int places = devices.rig.targets && devices.target ? devices.rig.targets->traps : 0;
  if (places < plan.places)
    throw InputError(
        what, fmt::format("puts a light trap in {} places, the lab has {}", plan.places, places),
        "describe it in [targets.trap] of lab.toml, or lower plan.places");
  ExpandedGlarePlan expanded;
  expanded.plan = plan;
  expanded.ladder_s = TargetLadder(plan, devices);
  for (const std::string& name : rig::TargetNames(*devices.rig.targets))
    if (name.starts_with("trap") && static_cast<int>(expanded.targets.size()) < plan.places)
      expanded.targets.push_back(name);
  return expanded;
}

session::PlanFile ToPlanFile(const ExpandedGlarePlan& e) {
  session::PlanFile file = TargetPlanFile(PlanKind::kGlare, e.plan, e.ladder_s);
  file.exposure->repeats = e.plan.repeats;
  file.views = Views(e.targets);
  return file;
}

GlareCaptureEstimate DryRun(const ExpandedGlarePlan& e, const hal::Devices& devices) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  GlareCaptureEstimate estimate;
  estimate.frames = e.plan.places * e.plan.repeats;
  estimate.darks =
      e.plan.repeats;  // the places have one exposure time as long as the light is even
  estimate.duration_s =
      (estimate.frames + estimate.darks) * (e.ladder_s.back() + camera.readout_s) +
      std::accumulate(e.ladder_s.begin(), e.ladder_s.end(), 0.0) * e.plan.places;
  estimate.bytes =
      FrameBytes(camera) * static_cast<std::uint64_t>(estimate.frames + estimate.darks);
  return estimate;
}

}  // namespace luxfield::capture
