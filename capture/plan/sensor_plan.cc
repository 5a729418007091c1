#include "luxfield/capture/plan/sensor_plan.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <utility>

#include "luxfield/capture/plan/expanded_plan.h"
#include "luxfield/core/error.h"

namespace luxfield::capture {

SensorPlan ReadSensorPlan(const std::filesystem::path& path) {
  return ReadSensorPlan(core::Config::FromFile(path));
}

SensorPlan ReadSensorPlan(const core::Config& config) {
  SensorPlan plan;
  const core::Config head = config.Table("plan");
  if (ReadPlanKind(config) != PlanKind::kSensor)
    head.Fail("kind", "is not \"sensor\"", "give a plan that calibrates a sensor");
  plan.name = head.Text("name", "unnamed plan");
  plan.channels = head.Integer("channels", 1, 1, 3);
  if (plan.channels == 2) head.Fail("channels", "must be 1 (luminance) or 3 (R, G, B)");
  const core::Config exposure = config.Table("exposure");
  plan.min_s = exposure.Number("min_s", {1e-9, 1e4});
  plan.max_s = exposure.Number("max_s", {plan.min_s, 1e5});
  plan.levels = exposure.Integer("levels", plan.levels, 6, 200);
  plan.pairs = exposure.Integer("pairs", plan.pairs, 1, 1000);
  plan.pwm_hz = exposure.Number("pwm_hz", plan.pwm_hz, {0, 1e6});
  plan.max_attempts = exposure.Integer("max_attempts", plan.max_attempts, 1, 100);
  if (std::pow(plan.max_s / plan.min_s, 1.0 / (plan.levels - 1)) < 1.05)
    exposure.Fail("levels", "puts neighbouring exposures within 5 % of each other",
                  "take fewer levels, or a wider range from min_s to max_s");
  plan.warm_up = ReadWarmUp(config);
  config.Finish();
  return plan;
}

ExpandedSensorPlan ExpandPlan(const SensorPlan& plan, const hal::Devices& devices) {
  const auto channels = static_cast<int>(devices.rig.camera.responsivity_e_per_s_per_w_m2.size());
  if (plan.channels != channels)
    throw InputError(fmt::format("plan \"{}\"", plan.name),
                     fmt::format("plan.channels = {}, but the lab has {}", plan.channels, channels),
                     "correct the plan or use the lab it was made for");
  const double ratio = std::pow(plan.max_s / plan.min_s, 1.0 / (plan.levels - 1));
  return {plan, MakeLadder(plan.min_s, plan.max_s, ratio,
                           plan.pwm_hz > 0 ? plan.pwm_hz : devices.rig.pwm_hz,
                           devices.camera->capabilities(), plan.name)};
}

session::PlanFile ToPlanFile(const ExpandedSensorPlan& e) {
  session::PlannedExposures exposure;
  exposure.ladder_s = e.ladder_s;
  exposure.pairs = e.plan.pairs;
  exposure.max_attempts = e.plan.max_attempts;
  session::PlanFile file;
  file.kind = PlanKind::kSensor;
  file.name = e.plan.name;
  file.channels = e.plan.channels;
  file.exposure = std::move(exposure);
  file.warm_up = e.plan.warm_up;
  return file;
}

SensorCaptureEstimate DryRun(const ExpandedSensorPlan& e, const hal::Devices& devices) {
  const hal::CameraCapabilities camera = devices.camera->capabilities();
  const auto rungs = static_cast<int>(e.ladder_s.size());
  const double ladder_s =
      std::accumulate(e.ladder_s.begin(), e.ladder_s.end(), 0.0) + rungs * camera.readout_s;
  const int frames = 2 * e.plan.pairs;  // of each exposure time
  SensorCaptureEstimate estimate;
  estimate.darks = frames * rungs;
  estimate.flats = estimate.darks * e.channels_in_turn;
  estimate.duration_s = frames * (1 + e.channels_in_turn) * ladder_s;
  estimate.bytes = FrameBytes(camera) * static_cast<std::uint64_t>(estimate.darks + estimate.flats);
  return estimate;
}

}  // namespace luxfield::capture
