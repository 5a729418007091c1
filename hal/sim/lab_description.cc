#include "luxfield/hal/sim/lab_description.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "luxfield/core/file.h"
#include "luxfield/hal/options/rig_options.h"
#include "luxfield/rig/cfa.h"

namespace luxfield::hal::sim {
namespace {

using rig::Chessboard;

constexpr double kTiny = std::numeric_limits<double>::min();

// Every error source is a table [errors.NAME] with its own switch. `read` sees the table whether it
// is on or not, so that its numbers are checked; the sizes count only where it is on and the lab is
// not ideal.
template <typename Read>
bool ErrorSource(const core::Config& errors, const char* name, bool ideal, Read&& read) {
  const auto table = errors.OptionalTable(name);
  if (!table) return false;
  const bool on = table->Boolean("enabled", true) && !ideal;
  read(*table, on);
  return on;
}

void TakeRig(const rig::RigDescription& rig, LabDescription& lab) {
  lab.rig = rig.kind;
  lab.geometry.delta_m = rig.delta_m;
  lab.albedo = rig.albedo;
  lab.filter.dual = rig.dual;
  lab.filter.basis = rig.basis;
  lab.filter.spacing_m = rig.spacing_m;
  lab.filter.scale = rig.filter_scale;
}

void ReadCamera(const core::Config& config, LabDescription& lab) {
  const core::Config camera = config.Table("camera");
  SimulatedSensor& sensor = lab.camera.sensor;
  sensor.width = camera.Integer("width", 1, 20000);
  sensor.height = camera.Integer("height", 1, 20000);
  sensor.responsivity_e_per_s_per_w_m2 =
      camera.Numbers("responsivity_e_per_s_per_w_m2", lab.channels);
  for (const double r : sensor.responsivity_e_per_s_per_w_m2)
    if (!(r > 0)) camera.Fail("responsivity_e_per_s_per_w_m2", "must be above 0 in every channel");
  sensor.cfa = camera.Text("cfa", "");
  if (!sensor.cfa.empty() && !rig::IsBayer(sensor.cfa))
    camera.Fail("cfa", "must be RGGB, BGGR, GRBG or GBRG", "leave it out for a camera without one");
  if (!sensor.cfa.empty() && lab.channels != 3)
    camera.Fail("cfa", "sees three colours", "set lab.channels = 3");
  sensor.gain_dn_per_e = camera.Number("gain_dn_per_e", 1, {kTiny, 1e6});
  sensor.black_dn = camera.Number("black_dn", 0, {0, 60000});
  const int bits = camera.Integer("bits", 12, 8, 16);
  const double full = (1 << bits) - 1;
  const double saturation = camera.Number("saturation_dn", full, {sensor.black_dn + 1, full});
  sensor.bits = lab.ideal ? 32 : bits;
  sensor.saturation_dn = saturation;
  lab.camera.min_exposure_s = camera.Number("min_exposure_s", {1e-9, 1e4});
  lab.camera.max_exposure_s = camera.Number("max_exposure_s", {lab.camera.min_exposure_s, 1e5});
  lab.camera.exposure_step_s = camera.Number("exposure_step_s", 0, {0, 1});
  lab.camera.readout_s = camera.Number("readout_s", 0.05, {0, 100});

  std::array<lightfield::Vec2, 4> corners;
  if (lab.rig == rig::RigKind::kLensless) {
    lab.camera.pitch_m = camera.Number("pitch_m", {1e-7, 1});
    corners = CornersOfPixels(lab.camera.pitch_m, sensor.width, sensor.height);
  } else if (const auto lens = camera.OptionalTable("lens")) {
    lab.geometry.camera = ReadLens(*lens, sensor.width, sensor.height);
    lab.target_light.blur_px = lens->Number("blur_px", lab.target_light.blur_px, {0.1, 10});
    lab.geometry.image_from_sensor =
        ImageFromSensor(*lab.geometry.camera, sensor.width, sensor.height, *lens);
    const auto& h = lab.geometry.image_from_sensor;
    const double w = sensor.width, height = sensor.height;
    const lightfield::Vec2 p[4] = {h.Map({0, 0}), h.Map({w, 0}), h.Map({w, height}),
                                   h.Map({0, height})};
    double area = 0;
    for (int k = 0; k < 4; ++k) {
      const lightfield::Vec2 a = p[k], b = p[(k + 1) % 4];
      area += 0.5 * (b.x * a.y - a.x * b.y);
    }
    lab.camera.pitch_m = std::sqrt(std::abs(area) / (w * height));
    return;
  } else {
    corners = ReadCorners(camera);
    double area = 0;
    for (int k = 0; k < 4; ++k) {
      const auto a = corners[k], b = corners[(k + 1) % 4];
      area += 0.5 * (b.x * a.y - a.x * b.y);
    }
    lab.camera.pitch_m = std::sqrt(area / (static_cast<double>(sensor.width) * sensor.height));
  }
  lab.geometry.image_from_sensor =
      rig::Homography::FromCorners(sensor.width, sensor.height, corners);
}

// [targets]: what calibrates the geometry, and how it is lit.
void ReadTargets(const core::Config& config, LabDescription& lab) {
  const auto table = config.OptionalTable("targets");
  if (!table) return;
  const core::Config& c = *table;
  rig::CalibrationTargets targets;
  const auto chessboard = [&](const char* name) {
    const core::Config t = c.Table(name);
    const Chessboard board{t.Integer("columns", 3, 100), t.Integer("rows", 3, 100),
                           t.Number("pitch_m", {1e-6, 1})};
    if ((board.columns + board.rows) % 2 == 0)
      t.Fail("columns", "and rows must be an odd and an even number",
             "or a half turn of the chessboard could not be seen");
    return board;
  };
  if (lab.geometry.camera) {
    targets.board = chessboard("board");
    targets.board_poses = c.Integer("board_poses", 12, 1, 100);
    lab.target_light.room_irradiance = c.Number("room_irradiance", {kTiny, 1e9});
  } else if (lab.rig == rig::RigKind::kReflector) {
    c.Fail("board", "needs a camera with a place and a lens", "give [camera.lens] for corners_m");
  }
  targets.mask = chessboard("mask");
  targets.spacer_m = c.Number("spacer_m", {1e-4, 10});
  targets.spacer_shift_m = c.Number("spacer_shift_m", 0, {0, 1e-3});
  const auto source = c.Numbers("source_m", 3);
  lab.target_light.source_m = {source[0], source[1], source[2]};
  if (!(source[2] < -targets.spacer_m))
    c.Fail("source_m", "lies before the mask on its spacer", "move it back: z below -spacer_m");
  lab.target_light.source_rms_m = c.Number("source_rms_m", 2e-4, {1e-9, 1e-2});
  lab.target_light.source_intensity = c.Number("source_intensity", {kTiny, 1e9});
  if (const auto trap = c.OptionalTable("trap")) {
    if (lab.rig == rig::RigKind::kLensless)
      c.Fail("trap", "needs a camera with a lens", "leave it out: without a lens nothing veils");
    targets.traps = trap->Integer("places", 3, 1, 100);
    lab.target_light.trap_radius_m = trap->Number("radius_m", {1e-6, 10});
    lab.target_light.room_irradiance = c.Number("room_irradiance", {kTiny, 1e9});
  }
  lab.targets = targets;
}

void ReadErrors(const core::Config& config, LabDescription& lab) {
  const auto table = config.OptionalTable("errors");
  if (!table) return;
  const core::Config& errors = *table;
  const auto set = [](bool on, double& target, double value) {
    if (on) target = value;
  };
  const auto source = [&](const char* name, auto&& read) {
    return ErrorSource(errors, name, lab.ideal, read);
  };
  SimulatedSensor& sensor = lab.camera.sensor;
  lab.camera.sensor.photon_noise = source("photon_noise", [](const core::Config&, bool) {});
  source("read_noise", [&](const core::Config& c, bool on) {
    set(on, sensor.read_noise_dn, c.Number("rms_dn", {kTiny, 1e4}));
  });
  source("dark_current", [&](const core::Config& c, bool on) {
    set(on, sensor.dark_current_e_per_s, c.Number("e_per_s", {kTiny, 1e6}));
  });
  source("prnu", [&](const core::Config& c, bool on) {
    set(on, sensor.prnu, c.Number("rms", {kTiny, 0.2}));
  });
  source("hot_pixels", [&](const core::Config& c, bool on) {
    const int count = c.Integer("count", 1, 1000000);
    if (on) sensor.hot_pixels = count;
    set(on, sensor.hot_current_e_per_s, c.Number("e_per_s", {kTiny, 1e9}));
    lab.camera.hot_pixels_calibrated = c.Boolean("calibrated", true);
  });
  source("vignetting", [&](const core::Config& c, bool on) {
    set(on, sensor.corner_loss, c.Number("corner_loss", {kTiny, 0.95}));
    lab.camera.vignetting_calibrated = c.Boolean("calibrated", true);
  });
  source("shutter", [&](const core::Config& c, bool on) {
    set(on, lab.camera.shutter.jitter_s, c.Number("jitter_s", 0, {0, 1}));
    set(on, lab.camera.shutter.offset_s, c.Number("offset_s", 0, {-1, 1}));
    set(on, lab.camera.shutter.time_s, c.Number("time_s", 0, {0, 1}));
  });
  source("warm_up", [&](const core::Config& c, bool on) {
    set(on, lab.lamp_time.warm_up_excess, c.Number("excess", {-0.9, 10}));
    set(on, lab.lamp_time.warm_up_tau_s, c.Number("tau_s", {1e-3, 1e6}));
  });
  source("drift", [&](const core::Config& c, bool on) {
    set(on, lab.lamp_time.drift_per_hour, c.Number("per_hour", 0, {-0.5, 0.5}));
    set(on, lab.lamp_time.drift_amplitude, c.Number("amplitude", 0, {0, 0.5}));
    set(on, lab.lamp_time.drift_period_s, c.Number("period_s", 1800, {1, 1e6}));
    set(on, lab.lamp_time.drift_phase_rad,
        c.Number("phase_deg", 0, {-360, 360}) * std::numbers::pi / 180);
  });
  source("pwm", [&](const core::Config& c, bool on) {
    set(on, lab.lamp_time.pwm_hz, c.Number("hz", {1, 1e6}));
    set(on, lab.lamp_time.pwm_duty, c.Number("duty", {1e-3, 1}));
  });
  source("geometry", [&](const core::Config& c, bool on) {
    ReadGeometryErrors(c, on, sensor.width, sensor.height, lab.geometry);
  });
  source("stage", [&](const core::Config& c, bool on) {
    set(on, lab.stage.repeatability_m, c.Number("repeatability_m", {kTiny, 1e-2}));
  });
  source("registration", [&](const core::Config& c, bool on) {
    const auto shift = c.Numbers("shift_m", 2, {0, 0});
    set(on, lab.filter.errors.shift_m.x, shift[0]);
    set(on, lab.filter.errors.shift_m.y, shift[1]);
    set(on, lab.filter.errors.rotation_rad,
        c.Number("rotation_deg", 0, {-10, 10}) * std::numbers::pi / 180);
  });
  source("density", [&](const core::Config& c, bool on) {
    set(on, lab.filter.errors.density, c.Number("relative", 0, {-0.9, 1}));
    set(on, lab.filter.errors.density_gamma, c.Number("gamma", 0, {-0.5, 1}));
    set(on, lab.filter.errors.grain, c.Number("grain", 0, {0, 0.5}));
    set(on, lab.filter.errors.grain_size_m, c.Number("grain_size_m", 1e-3, {1e-6, 1}));
  });
  source("stray_light", [&](const core::Config& c, bool on) {
    set(on, lab.scatter.stray_share, c.Number("share", {kTiny, 1}));
  });
  source("blooming", [&](const core::Config& c, bool on) {
    set(on, sensor.blooming_share, c.Number("share", {kTiny, 1}));
    set(on, sensor.blooming_px, c.Number("reach_px", {0.1, 1e4}));
  });
  source("glare", [&](const core::Config& c, bool on) {
    set(on, lab.scatter.glare.share, c.Number("share", {kTiny, 0.5}));
    set(on, lab.scatter.glare.reach_px, c.Number("reach_px", {0.5, 1e5}));
  });
  source("monitor_noise", [&](const core::Config& c, bool on) {
    set(on, lab.monitor_noise, c.Number("relative", {kTiny, 0.5}));
  });
}

}  // namespace

FilterPrint LabDescription::Print() const {
  constexpr std::uint64_t kPrintSeed = 0x7072696E74;
  using lightfield::FilterKind;
  return {rig::FilterSheet::Make(filter.dual ? FilterKind::kDual : FilterKind::kBasis, filter.basis,
                                 filter.spacing_m, filter.scale),
          filter.errors, seed ^ kPrintSeed};
}

LabDescription ReadLab(const core::Config& config, std::optional<std::uint64_t> seed) {
  LabDescription lab;
  const core::Config head = config.Table("lab");
  if (head.Text("driver") != "sim")
    head.Fail("driver", "is not that of a simulated lab", "use a lab.toml with driver = \"sim\"");
  lab.name = head.Text("name", "simulated lab");
  lab.ideal = head.Boolean("ideal", false);
  const int file_seed = head.Integer("seed", 1, 0, std::numeric_limits<int>::max());
  lab.seed = seed.value_or(static_cast<std::uint64_t>(file_seed));
  lab.channels = head.Integer("channels", 1, 1, 3);
  if (lab.channels == 2) head.Fail("channels", "must be 1 (luminance) or 3 (R, G, B)");
  TakeRig(ReadRig(config), lab);
  const core::Config lamp = config.Table("lamp");
  lab.lamp = MakeLamp(lamp, lab.channels);
  if (const auto* field = lab.lamp->field();
      field && field->geometry.delta_m != lab.geometry.delta_m)
    lamp.Fail("file",
              "has delta = " + std::to_string(field->geometry.delta_m) + " m, the rig " +
                  std::to_string(lab.geometry.delta_m),
              "set rig.delta_m to the file's");
  if (lab.lamp->field()) lab.files["lamp.file"] = core::Sha256OfFile(lamp.Path("file"));
  ReadCamera(config, lab);

  lab.stage.options = ReadStage(config.Table("stage"));

  if (const auto sampling = config.OptionalTable("sampling")) {
    lab.tracing.u_samples_per_cell =
        sampling->Integer("u_per_cell", lab.tracing.u_samples_per_cell, 1, 64);
    lab.tracing.s_samples_per_pixel =
        sampling->Integer("s_per_pixel", lab.tracing.s_samples_per_pixel, 1, 16);
    lab.tracing.memory_bytes = std::size_t{1} << 20;
    lab.tracing.memory_bytes *=
        static_cast<std::size_t>(sampling->Integer("memory_mib", 1024, 1, 1 << 20));
  } else {
    lab.tracing.memory_bytes = std::size_t{1} << 30;
  }
  lab.stated = lab.geometry;
  ReadErrors(config, lab);
  lab.stage.options.limits.repeatability_m = lab.stage.repeatability_m;
  ReadTargets(config, lab);
  if (const auto bench = config.Table("filter").OptionalTable("bench"))
    lab.filter_bench_irradiance = bench->Number("irradiance", {kTiny, 1e9});
  return lab;
}

}  // namespace luxfield::hal::sim
