// What lab.toml says about a simulated lab (docs/formats/lab-and-plan.md).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "luxfield/core/config.h"
#include "luxfield/hal/devices.h"
#include "luxfield/hal/options/stage_options.h"
#include "luxfield/hal/sim/bench_geometry.h"
#include "luxfield/hal/sim/glare.h"
#include "luxfield/hal/sim/lamp.h"
#include "luxfield/hal/sim/lamp_time.h"
#include "luxfield/hal/sim/print.h"
#include "luxfield/hal/sim/sensor.h"

namespace luxfield::hal::sim {

// How the calibration targets are lit, and what the camera sees of them.
struct TargetLight {
  double room_irradiance = 1;             // on the board, W m^-2 (or lx, or relative)
  double source_intensity = 1;            // of the small source behind the mask, W sr^-1 (...)
  lightfield::Vec3 source_m{0, 0, -0.4};  // from the filter's centre, stage at (0, 0)
  double source_rms_m = 2e-4;             // of its Gaussian disc, per axis
  double blur_px = 0.5;                   // rms of the camera's point spread
  double trap_radius_m = 0;               // of the light trap, a black disc
};

// The filter as the lab states it, and what its print does otherwise.
struct SimulatedFilter {
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  double spacing_m = 0;
  double scale = 1;
  bool dual = false;
  PrintErrors errors;
};

// The real exposure less the one read back: always, and rms about that.
struct ShutterErrors {
  double offset_s = 0, time_s = 0, jitter_s = 0;
};

struct SimulatedCamera {
  SimulatedSensor sensor;
  double pitch_m = 0;  // of the pixels on I; for the reflector rig their mean
  bool vignetting_calibrated = true, hot_pixels_calibrated = true;
  double min_exposure_s = 0, max_exposure_s = 0, exposure_step_s = 0, readout_s = 0;
  ShutterErrors shutter;
};

struct SimulatedStage {
  StageOptions options;
  double repeatability_m = 0;  // rms per axis and move; the encoder does not see it
};

// Light that ends up where it does not belong.
struct ScatteredLight {
  double stray_share = 0;  // of each image's mean irradiance, spread evenly over it
  Glare glare;
};

// How finely the lamp is traced, and in how much memory.
struct Tracing {
  int u_samples_per_cell = 3, s_samples_per_pixel = 1;
  std::size_t memory_bytes = 0;
};

struct LabDescription {
  std::string name;
  bool ideal = false;
  std::uint64_t seed = 1;
  int channels = 1;

  rig::RigKind rig = rig::RigKind::kLensless;
  BenchGeometry geometry;  // as it is
  BenchGeometry stated;    // as session.json has it
  double albedo = 1;

  SimulatedFilter filter;
  // The print in the rig, with its errors; the same one on every bench of the lab.
  FilterPrint Print() const;

  std::shared_ptr<const Lamp> lamp;
  std::map<std::string, std::string> files;  // that lab.toml names: field, SHA-256
  LampTime lamp_time;
  double monitor_noise = 0;  // relative, rms

  SimulatedCamera camera;
  SimulatedStage stage;
  ScatteredLight scatter;

  std::optional<rig::CalibrationTargets> targets;  // as the lab states them
  TargetLight target_light;
  std::optional<double> filter_bench_irradiance;  // E' behind the filter's empty holder

  Tracing tracing;
};

// Reads [lab] ... [errors.*]; throws InputError naming file and field. `seed` replaces the file's.
LabDescription ReadLab(const core::Config& config, std::optional<std::uint64_t> seed);

}  // namespace luxfield::hal::sim
