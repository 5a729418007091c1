// plan.toml of kind "sensor": the frames that calibrate a camera (docs/formats/lab-and-plan.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/capture/plan/plan.h"

namespace luxfield::capture {

// Flats over a ladder of exposure times, `pairs` pairs each and channel, and as many darks of each
// time. The lamp is steady and even over the sensor: an integrating sphere, or a screen.
struct SensorPlan {
  std::string name;
  int channels = 1;
  double min_s = 0, max_s = 0;  // from about 1 % of saturation to 1.3 times it
  int levels = 16;              // geometric from min_s to max_s
  int pairs = 1;
  double pwm_hz = 0;  // exposures become whole multiples of 1/pwm_hz; 0: the rig's own frequency
  int max_attempts = 3;
  WarmUpPolicy warm_up;
};

// Throws InputError naming file and field.
SensorPlan ReadSensorPlan(const std::filesystem::path& path);
SensorPlan ReadSensorPlan(const core::Config& config);

struct ExpandedSensorPlan {
  SensorPlan plan;
  std::vector<double> ladder_s;  // rising
  int channels_in_turn = 1;      // flats of each exposure; one shows all colours of a mosaic
};

// Throws InputError for exposures outside the camera's or channels that the rig does not have.
ExpandedSensorPlan ExpandPlan(const SensorPlan& plan, const hal::Devices& devices);

session::PlanFile ToPlanFile(const ExpandedSensorPlan& expanded);

struct SensorCaptureEstimate {
  int flats = 0, darks = 0;
  double duration_s = 0;  // without warm-up
  std::uint64_t bytes = 0;
};
SensorCaptureEstimate DryRun(const ExpandedSensorPlan& expanded, const hal::Devices& devices);

}  // namespace luxfield::capture
