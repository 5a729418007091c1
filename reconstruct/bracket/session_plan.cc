#include "luxfield/reconstruct/bracket/session_plan.h"

#include "luxfield/session/plan_file.h"
#include "luxfield/session/session_file.h"
#include "luxfield/session/stated.h"

namespace luxfield::reconstruct {

SessionPlan ReadSessionPlan(const session::SessionReader& session) {
  using session::Stated;
  const std::string plan_file = (session.folder() / "plan.json").string();
  const std::string session_file = (session.folder() / "session.json").string();
  const session::PlanFile plan = session::PlanOf(session);
  const session::SessionSetup setup = session::SetupOf(session);
  SessionPlan result;
  result.geometry = Stated(plan.geometry, "geometry", plan_file);
  const session::PlannedFilter& filter = Stated(plan.filter, "filter", plan_file);
  result.filter = filter.kind;
  if (filter.kind == lightfield::FilterKind::kBasis) result.filter_scale = filter.scale;
  const session::PlannedRig& rig = Stated(plan.rig, "rig", plan_file);
  result.rig = rig.kind;
  if (rig.kind == rig::RigKind::kReflector) result.albedo = rig.albedo;
  if (plan.exposure && plan.exposure->mean_tolerance)
    result.level_tolerance = *plan.exposure->mean_tolerance;
  result.image_from_sensor = Stated(setup.image_from_sensor, "image_from_sensor", session_file);
  result.sensor =
      session::SensorModelOf(setup, session_file, session.folder(), result.geometry.channels);
  return result;
}

}  // namespace luxfield::reconstruct
