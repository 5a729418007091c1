// plan.toml of kind "geometry": the frames that tell where the parts of a lab stand
// (docs/formats/lab-and-plan.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/capture/plan/target_plan.h"
#include "luxfield/hal/safety/stage_bounds.h"
#include "luxfield/rig/rig_description.h"

namespace luxfield::capture {

struct GeometryPlan : TargetPlan {
  int poses = 10;          // of the board before the camera, beside the one on I; reflector rig
  double step_m = 0;       // of the stage, to either side along u and v
  hal::StageBounds stage;  // to open the lab's devices with
};

// Throws InputError naming file and field.
GeometryPlan ReadGeometryPlan(const std::filesystem::path& path);
GeometryPlan ReadGeometryPlan(const core::Config& config);

struct ExpandedGeometryPlan {
  GeometryPlan plan;
  std::vector<double> ladder_s;  // rising
  rig::CalibrationTargets targets;
  double stage_repeatability_m = 0;
  std::vector<session::PlannedView> views;  // all with a set point of the stage
};

// The board on I and in `poses` others (reflector rig), the stage at home; then the mask with the
// stage at home and a step to either side along u and along v, and all of that again on the spacer.
// Throws InputError for a lab without targets or with fewer poses, for a step beyond the stage's
// limits and exposures beyond the camera's.
ExpandedGeometryPlan ExpandPlan(const GeometryPlan& plan, const hal::Devices& devices);

session::PlanFile ToPlanFile(const ExpandedGeometryPlan& expanded);

struct GeometryCaptureEstimate {
  int boards = 0, masks = 0;
  double duration_s = 0;  // without handling of the targets
  std::uint64_t bytes = 0;
};
GeometryCaptureEstimate DryRun(const ExpandedGeometryPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
