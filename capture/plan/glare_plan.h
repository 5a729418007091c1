// plan.toml of kind "glare": the frames that tell how much light lens and housing scatter over a
// picture (docs/formats/lab-and-plan.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/capture/plan/target_plan.h"

namespace luxfield::capture {

// The screen evenly lit, a light trap on it in one place after the other.
struct GlarePlan : TargetPlan {
  int places = 3;
  int repeats = 4;  // frames of each place, and darks of each exposure time
};

// Throws InputError naming file and field.
GlarePlan ReadGlarePlan(const core::Config& config);

struct ExpandedGlarePlan {
  GlarePlan plan;
  std::vector<double> ladder_s;      // rising
  std::vector<std::string> targets;  // "trap 1" ...: rig::TargetNames
};

// Throws InputError for a lab without a light trap or with fewer places for it, and for exposures
// beyond the camera's.
ExpandedGlarePlan ExpandPlan(const GlarePlan& plan, const hal::Devices& devices);

session::PlanFile ToPlanFile(const ExpandedGlarePlan& expanded);

struct GlareCaptureEstimate {
  int frames = 0, darks = 0;
  double duration_s = 0;  // without handling of the trap
  std::uint64_t bytes = 0;
};
GlareCaptureEstimate DryRun(const ExpandedGlarePlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
