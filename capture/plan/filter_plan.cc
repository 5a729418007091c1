#include "luxfield/capture/plan/filter_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"
#include "luxfield/rig/filter_views.h"

namespace luxfield::capture {

FilterPlan ReadFilterPlan(const core::Config& config) {
  FilterPlan plan;
  const core::Config head = config.Table("plan");
  if (ReadPlanKind(config) != PlanKind::kFilter)
    head.Fail("kind", "is not \"filter\"", "give a plan that photographs a filter");
  plan.name = head.Text("name", "unnamed plan");
  const core::Config exposure = config.Table("exposure");
  plan.min_s = exposure.Number("min_s", {1e-9, 1e4});
  plan.max_s = exposure.Number("max_s", {plan.min_s, 1e5});
  plan.saturation_share = exposure.Number("saturation_share", plan.saturation_share, {0.1, 0.95});
  plan.exposures = exposure.Integer("exposures", plan.exposures, 1, 6);
  plan.repeats = exposure.Integer("repeats", plan.repeats, 1, 1000);
  plan.max_attempts = exposure.Integer("max_attempts", plan.max_attempts, 1, 100);
  config.Finish();
  return plan;
}

ExpandedFilterPlan ExpandPlan(const FilterPlan& plan, const hal::Devices& devices) {
  const std::string what = fmt::format("plan \"{}\"", plan.name);
  ExpandedFilterPlan expanded;
  expanded.plan = plan;
  const hal::RigDescription& rig = devices.rig;
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
  expanded.ladder_s =
      MakeLadder(plan.min_s, plan.max_s, 2, rig.pwm_hz, devices.camera->capabilities(), plan.name);
  return expanded;
}

nlohmann::json ToJson(const ExpandedFilterPlan& e) {
  core::Json views = core::Json::array();
  for (const std::string& view : e.views) views.push_back({{"target", view}});
  return {{"kind", "filter"},
          {"name", e.plan.name},
          {"sheet", core::Json::parse(rig::SheetText(e.sheet))},
          {"exposure",
           {{"ladder_s", e.ladder_s},
            {"saturation_share", e.plan.saturation_share},
            {"exposures", e.plan.exposures},
            {"repeats", e.plan.repeats},
            {"max_attempts", e.plan.max_attempts}}},
          {"views", views}};
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
