#include "luxfield/capture/plan/geometry_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/capture/plan/stage_reach.h"
#include "luxfield/core/error.h"

namespace luxfield::capture {

GeometryPlan ReadGeometryPlan(const std::filesystem::path& path) {
  return ReadGeometryPlan(core::Config::FromFile(path));
}

GeometryPlan ReadGeometryPlan(const core::Config& config) {
  GeometryPlan plan;
  ReadTargetPlan(config, PlanKind::kGeometry, "calibrates the geometry", plan);
  plan.poses = config.Table("plan").Integer("poses", plan.poses, 2, 100);
  const core::Config stage = config.Table("stage");
  plan.step_m = stage.Number("step_m", {1e-6, 10});
  plan.stage = hal::ReadStageBounds(stage);
  config.Finish();
  return plan;
}

ExpandedGeometryPlan ExpandPlan(const GeometryPlan& plan, const hal::Devices& devices) {
  const std::string what = fmt::format("plan \"{}\"", plan.name);
  if (!devices.rig.targets || !devices.target)
    throw InputError(what, "calibrates the geometry, but the lab has no targets",
                     "describe its board and mask in [targets] of lab.toml");
  ExpandedGeometryPlan expanded;
  expanded.plan = plan;
  expanded.targets = *devices.rig.targets;
  expanded.ladder_s = TargetLadder(plan, devices);
  const StageReach reach(plan.name, plan.stage, *devices.stage);
  expanded.stage_repeatability_m = devices.stage->limits().repeatability_m;
  if (expanded.targets.board) {
    if (plan.poses > expanded.targets.board_poses)
      throw InputError(what,
                       fmt::format("plan.poses = {}, the lab's board has {}", plan.poses,
                                   expanded.targets.board_poses),
                       "lower plan.poses");
    expanded.targets.board_poses = plan.poses;
  }
  const double step = plan.step_m;
  const std::vector<std::string> names = rig::TargetNames(expanded.targets);
  for (const std::string& target : names) {
    if (target.starts_with("board")) {
      reach.Require({0, 0}, target + " with the stage at (0, 0) m", "take wider limits");
      expanded.views.push_back({target, hal::Vec2{0, 0}});
    }
    if (!target.starts_with("mask")) continue;
    for (const hal::Vec2 at : {hal::Vec2{0, 0}, hal::Vec2{step, 0}, hal::Vec2{-step, 0},
                               hal::Vec2{0, step}, hal::Vec2{0, -step}}) {
      reach.Require(at, fmt::format("stage.step_m = {}: ({:.6g}, {:.6g}) m", step, at.x, at.y),
                    "lower it");
      expanded.views.push_back({target, at});
    }
  }
  return expanded;
}

session::PlanFile ToPlanFile(const ExpandedGeometryPlan& e) {
  session::PlanFile file = TargetPlanFile(PlanKind::kGeometry, e.plan, e.ladder_s);
  file.targets = {e.targets.board, e.targets.mask, e.targets.spacer_m, e.targets.spacer_shift_m};
  file.stage = Planned(e.plan.stage);
  file.stage->repeatability_m = e.stage_repeatability_m;
  file.views = e.views;
  return file;
}

GeometryCaptureEstimate DryRun(const ExpandedGeometryPlan& e, const hal::Devices& devices) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const hal::StageLimits stage = devices.stage->limits();
  GeometryCaptureEstimate estimate;
  hal::Vec2 at{0, 0};
  for (const session::PlannedView& view : e.views) {
    ++(view.target.starts_with("board") ? estimate.boards : estimate.masks);
    const double way =
        std::max(std::abs(view.setpoint->x - at.x), std::abs(view.setpoint->y - at.y));
    if (way > 0) estimate.duration_s += way / stage.speed_m_per_s + stage.settle_s;
    at = *view.setpoint;
  }
  // At most the whole ladder, downwards, before the first frame of a kind of target fits.
  const auto frames = static_cast<double>(e.views.size());
  estimate.duration_s += frames * (e.ladder_s.back() + camera.readout_s) +
                         3 * std::accumulate(e.ladder_s.begin(), e.ladder_s.end(), 0.0);
  estimate.bytes = FrameBytes(camera) * e.views.size();
  return estimate;
}

}  // namespace luxfield::capture
