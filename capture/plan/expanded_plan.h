// A plan made definite for a rig: every position, every exposure time, in order.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"
#include "luxfield/rig/rig_description.h"

namespace luxfield::capture {

using session::PlannedPosition;

struct ExpandedPlan {
  Plan plan;
  std::vector<double> ladder_s;            // rising
  std::vector<PlannedPosition> positions;  // in the order they are visited
  hal::Vec2 reference;                     // where drift is measured: the grid's central position
  int prints = 1;
  int channels_in_turn = 1;  // brackets of a position and print; one takes all of a colour mosaic's
};

// Checks the plan against the rig: same rig kind, delta, basis, spacing, print scale, channels,
// albedo; all positions within the stage's limits, all exposures within the camera's. Throws
// InputError naming the plan's field.
ExpandedPlan ExpandPlan(const Plan& plan, const hal::Devices& devices);

// The frequency whose whole periods the exposures are; 0: any.
double PwmHz(const ExposurePolicy& exposure, const rig::RigDescription& rig);

// min_s, min_s * ratio, ... up to max_s, as whole periods of pwm_hz where that is above 0, or the
// nearest of the camera's shutter speeds where it has a list; times that come within 5 % of the one
// before are left out. Throws InputError naming exposure.min_s or max_s of the plan of that name
// outside the camera's range, and for both periods and a list.
std::vector<double> MakeLadder(double min_s, double max_s, double ratio, double pwm_hz,
                               const hal::CameraCapabilities& camera, const std::string& plan_name);

session::PlanFile ToPlanFile(const ExpandedPlan& expanded);

// What a capture will need at most: brackets are shorter where an image is bright or dark all over.
struct CaptureEstimate {
  int positions = 0;
  int frames = 0;
  double duration_s = 0;  // without warm-up
  double stage_path_m = 0;
  std::uint64_t bytes = 0;
  double off_sensor_share =
      0;  // of the lattice's texels, over all positions: unknown to the reconstruction
};
// Of a frame's file, at most.
std::uint64_t FrameBytes(const hal::CameraCapabilities& camera);
CaptureEstimate DryRun(const ExpandedPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
