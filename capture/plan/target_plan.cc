#include "luxfield/capture/plan/target_plan.h"

#include <fmt/format.h>

#include "luxfield/capture/plan/expanded_plan.h"

namespace luxfield::capture {

void ReadTargetPlan(const core::Config& config, PlanKind kind, const std::string& what,
                    TargetPlan& plan) {
  const core::Config head = config.Table("plan");
  if (ReadPlanKind(config) != kind)
    head.Fail("kind", fmt::format("is not \"{}\"", session::PlanKindName(kind)),
              "give a plan that " + what);
  plan.name = head.Text("name", "unnamed plan");
  const core::Config exposure = config.Table("exposure");
  plan.min_s = exposure.Number("min_s", {1e-9, 1e4});
  plan.max_s = exposure.Number("max_s", {plan.min_s, 1e5});
  plan.saturation_share = exposure.Number("saturation_share", plan.saturation_share, {0.1, 0.95});
  plan.max_attempts = exposure.Integer("max_attempts", plan.max_attempts, 1, 100);
}

std::vector<double> TargetLadder(const TargetPlan& plan, const hal::Devices& devices) {
  return MakeLadder(plan.min_s, plan.max_s, 2, devices.rig.pwm_hz, devices.camera->capabilities(),
                    plan.name);
}

session::PlanFile TargetPlanFile(PlanKind kind, const TargetPlan& plan,
                                 const std::vector<double>& ladder_s) {
  session::PlanFile file;
  file.kind = kind;
  file.name = plan.name;
  session::PlannedExposures& exposure = file.exposure.emplace();
  exposure.ladder_s = ladder_s;
  exposure.saturation_share = plan.saturation_share;
  exposure.max_attempts = plan.max_attempts;
  return file;
}

std::vector<session::PlannedView> Views(const std::vector<std::string>& targets) {
  std::vector<session::PlannedView> views;
  for (const std::string& target : targets) views.push_back({target, {}});
  return views;
}

}  // namespace luxfield::capture
