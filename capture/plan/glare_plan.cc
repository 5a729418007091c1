#include "luxfield/capture/plan/glare_plan.h"

#include <fmt/format.h>

#include <numeric>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"
#include "luxfield/core/json.h"

namespace luxfield::capture {

GlarePlan ReadGlarePlan(const core::Config& config) {
  GlarePlan plan;
  const core::Config head = config.Table("plan");
  if (ReadPlanKind(config) != PlanKind::kGlare)
    head.Fail("kind", "is not \"glare\"", "give a plan that measures the veiling glare");
  plan.name = head.Text("name", "unnamed plan");
  plan.places = head.Integer("places", plan.places, 1, 100);
  const core::Config exposure = config.Table("exposure");
  plan.min_s = exposure.Number("min_s", {1e-9, 1e4});
  plan.max_s = exposure.Number("max_s", {plan.min_s, 1e5});
  plan.saturation_share = exposure.Number("saturation_share", plan.saturation_share, {0.1, 0.95});
  plan.repeats = exposure.Integer("repeats", plan.repeats, 1, 1000);
  plan.max_attempts = exposure.Integer("max_attempts", plan.max_attempts, 1, 100);
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
  expanded.ladder_s = MakeLadder(plan.min_s, plan.max_s, 2, devices.rig.pwm_hz,
                                 devices.camera->capabilities(), plan.name);
  for (const std::string& name : hal::TargetNames(*devices.rig.targets))
    if (name.starts_with("trap") && static_cast<int>(expanded.targets.size()) < plan.places)
      expanded.targets.push_back(name);
  return expanded;
}

nlohmann::json ToJson(const ExpandedGlarePlan& e) {
  core::Json views = core::Json::array();
  for (const std::string& target : e.targets) views.push_back({{"target", target}});
  return {{"kind", "glare"},
          {"name", e.plan.name},
          {"exposure",
           {{"ladder_s", e.ladder_s},
            {"saturation_share", e.plan.saturation_share},
            {"repeats", e.plan.repeats},
            {"max_attempts", e.plan.max_attempts}}},
          {"views", views}};
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
