// plan.toml of kind "geometry": the frames that tell where the parts of a lab stand
// (docs/formats/lab-and-plan.md).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/hal/safety/stage_bounds.h"

namespace luxfield::capture {

struct GeometryPlan {
  std::string name;
  int poses = 10;     // of the board before the camera, beside the one on I; reflector rig
  double step_m = 0;  // of the stage, to either side along u and v
  double min_s = 0, max_s = 0;    // a frame takes the longest exposure, in factors of 2, that ...
  double saturation_share = 0.8;  // ... keeps every pixel below this share of saturation
  int max_attempts = 3;
  hal::StageBounds stage;  // to open the lab's devices with
};

// Throws InputError naming file and field.
GeometryPlan ReadGeometryPlan(const std::filesystem::path& path);
GeometryPlan ReadGeometryPlan(const core::Config& config);

struct GeometryView {
  std::string target;  // hal::TargetNames
  hal::Vec2 setpoint;  // of the stage
};

struct ExpandedGeometryPlan {
  GeometryPlan plan;
  std::vector<double> ladder_s;  // rising
  hal::CalibrationTargets targets;
  double stage_repeatability_m = 0;
  std::vector<GeometryView> views;
};

// The board on I and in `poses` others (reflector rig), the stage at home; then the mask with the
// stage at home and a step to either side along u and along v, and all of that again on the spacer.
// Throws InputError for a lab without targets or with fewer poses, for a step beyond the stage's
// limits and exposures beyond the camera's.
ExpandedGeometryPlan ExpandPlan(const GeometryPlan& plan, const hal::Devices& devices);

// plan.json (docs/formats/session.md).
nlohmann::json ToJson(const ExpandedGeometryPlan& expanded);

struct GeometryCaptureEstimate {
  int boards = 0, masks = 0;
  double duration_s = 0;  // without handling of the targets
  std::uint64_t bytes = 0;
};
GeometryCaptureEstimate DryRun(const ExpandedGeometryPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
