// What lab.toml says about a simulated lab (docs/formats/lab-and-plan.md).
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/config.h"
#include "hal/devices.h"
#include "hal/sim/homography.h"
#include "hal/sim/lamp.h"
#include "hal/sim/lamp_time.h"
#include "hal/sim/print.h"
#include "hal/sim/sensor.h"

namespace luxfield::hal::sim {

struct LabDescription {
  std::string name;
  bool ideal = false;
  std::uint64_t seed = 1;
  int channels = 1;

  RigKind rig = RigKind::kLensless;
  double delta_m = 0;
  double albedo = 1;

  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  double spacing_m = 0;
  double filter_scale = 1;
  bool dual = false;
  PrintErrors print_errors;
  // The print in the rig, with its errors; the same one on every bench of the lab.
  FilterPrint Print() const;

  std::shared_ptr<const Lamp> lamp;
  LampTime lamp_time;

  SensorModel sensor;
  double pitch_m = 0;  // of the pixels on I; for the reflector rig their mean
  Homography image_from_sensor{};
  bool vignetting_calibrated = true, hot_pixels_calibrated = true;
  double min_exposure_s = 0, max_exposure_s = 0, exposure_step_s = 0, readout_s = 0;
  double shutter_jitter_s = 0;  // rms difference of the real exposure from the one read back

  StageLimits stage;
  double stage_repeatability_m = 0;  // rms per axis and move; the encoder does not see it
  double stray_share = 0;            // of each image's mean irradiance, spread evenly over it
  double monitor_noise = 0;          // relative, rms

  int u_samples_per_cell = 3, s_samples_per_pixel = 1;
  std::size_t memory_bytes = 0;
};

// Reads [lab] ... [errors.*]; throws InputError naming file and field. `seed` replaces the file's.
LabDescription ReadLab(const core::Config& config, std::optional<std::uint64_t> seed);

}  // namespace luxfield::hal::sim
