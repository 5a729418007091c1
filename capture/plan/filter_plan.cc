#include "luxfield/capture/plan/filter_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"
#include "luxfield/rig/filter_views.h"

namespace luxfield::capture {

FilterPlan ReadFilterPlan(const core::Config& config) {
  FilterPlan plan;
  ReadTargetPlan(config, PlanKind::kFilter, "photographs a filter", plan);
  const core::Config exposure = config.Table("exposure");
  plan.exposures = exposure.Integer("exposures", plan.exposures, 1, 6);
  plan.repeats = exposure.Integer("repeats", plan.repeats, 1, 1000);
  config.Finish();
  return plan;
}

ExpandedFilterPlan ExpandPlan(const FilterPlan& plan, const hal::Devices& devices) {
  const std::string what = fmt::format("plan \"{}\"", plan.name);
  ExpandedFilterPlan expanded;
  expanded.plan = plan;
  const rig::RigDescription& rig = devices.rig;
  expanded.sheet = rig::FilterSheet::Make(
      rig.dual ? lightfield::FilterKind::kDual : lightfield::FilterKind::kBasis, rig.basis,
      rig.spacing_m, rig.filter_scale);
  expanded.views = rig::FilterViewNames(rig.dual);
  const std::vector<std::string> there =
      devices.target ? devices.target->positions() : std::vector<std::string>();
  for (const std::string& view : expanded.views)
    if (std::find(there.begin(), there.end(), view) == there.end())
      throw InputError(what, fmt::format("photographs \"{}\", which the lab does not have", view),
                       "describe the bench in [filter.bench] of lab.toml");
  if (!rig.camera.cfa.empty())
    throw InputError(what, "photographs a filter with a colour mosaic, which is not built",
                     "use a camera without one");
  expanded.ladder_s = TargetLadder(plan, devices);
  return expanded;
}

session::PlanFile ToPlanFile(const ExpandedFilterPlan& e) {
  session::PlanFile file = TargetPlanFile(PlanKind::kFilter, e.plan, e.ladder_s);
  file.exposure->exposures = e.plan.exposures;
  file.exposure->repeats = e.plan.repeats;
  file.sheet = e.sheet;
  file.views = Views(e.views);
  return file;
}

FilterCaptureEstimate DryRun(const ExpandedFilterPlan& e, const hal::Devices& devices) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const int prints = static_cast<int>(e.views.size()) - 1;
  FilterCaptureEstimate estimate;
  estimate.frames = e.plan.repeats * (1 + prints * e.plan.exposures);
  estimate.darks = e.plan.repeats * e.plan.exposures;
  estimate.duration_s = (estimate.frames + estimate.darks) * (e.ladder_s.back() + camera.readout_s);
  estimate.bytes =
      FrameBytes(camera) * static_cast<std::uint64_t>(estimate.frames + estimate.darks);
  return estimate;
}

}  // namespace luxfield::capture
