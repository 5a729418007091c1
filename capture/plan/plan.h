// plan.toml: what to measure and how carefully (docs/formats/lab-and-plan.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/safety/stage_bounds.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/session/plan_file.h"

namespace luxfield::capture {

// Exposure times form a ladder min, min * ratio, ... up to max; each bracket is a run of its rungs.
struct ExposurePolicy {
  double min_s = 0, max_s = 0;
  double ratio = 4;   // at most 8: neighbouring exposures have to overlap
  double pwm_hz = 0;  // exposures become whole multiples of 1/pwm_hz; 0: the rig's own frequency
  // pwm_hz is what the lamp is measured to have before the session begins (lamp_pulses.h), whatever
  // the rig says; 0: not yet measured, or it does not pulse.
  bool measure_pwm = false;
  double saturation_share =
      0.9;  // the shortest exposure keeps every pixel below this share of saturation
  double relevant_share = 1e-4;  // pixels above this share of the image's brightest one matter ...
  double floor_sigmas =
      5;  // ... and get a signal of at least so many read noises in the longest exposure
  int repeats = 1;
  int max_attempts =
      3;  // a frame that fails its checks is taken again so often, then kept and flagged
  double mean_tolerance = 0.05;  // of a frame's level against what shorter frames predict
  double flicker = 0;  // rms of equal frames' levels beyond noise (flicker.h); 0: not looked for
};

using session::ReferencePolicy;
using session::WarmUpPolicy;

enum class Order { kSerpentine, kRandom };

struct Plan {
  std::string name;
  lightfield::LuminaireGeometry geometry;
  rig::RigKind rig = rig::RigKind::kLensless;
  double albedo = 1;
  bool dual = false;
  double filter_scale = 1;
  ExposurePolicy exposure;
  ReferencePolicy reference;
  WarmUpPolicy warm_up;
  hal::StageBounds stage;  // to open the lab's devices with
  int dark_repeats = 4;    // per rung, at the start and again at the end
  Order order = Order::kSerpentine;
  std::uint64_t order_seed = 1;
};

// Throws InputError naming file and field.
Plan ReadPlan(const std::filesystem::path& path);
Plan ReadPlan(const core::Config& config);

// [warm_up] of any kind of plan; the defaults where it is absent.
WarmUpPolicy ReadWarmUp(const core::Config& config);

// plan.kind: what a plan.toml measures. A sensor plan is read by ReadSensorPlan (sensor_plan.h),
// one of the geometry by ReadGeometryPlan (geometry_plan.h), one of the glare by ReadGlarePlan
// (glare_plan.h), one of the printed filter by ReadFilterPlan (filter_plan.h).
using session::PlanKind;
PlanKind ReadPlanKind(const core::Config& config);

}  // namespace luxfield::capture
