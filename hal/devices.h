// A rig: its devices and what is known about them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/core/image.h"
#include "luxfield/hal/camera.h"
#include "luxfield/hal/error.h"
#include "luxfield/hal/instruments.h"
#include "luxfield/hal/stage.h"
#include "luxfield/hal/trigger.h"
#include "luxfield/lightfield/basis.h"
#include "luxfield/rig/chessboard.h"

namespace luxfield::hal {

class Watchdog;

enum class RigKind { kLensless, kReflector };
std::string RigKindName(RigKind kind);  // "lensless", "reflector"

// The noise and response model in force, as session.json has it (docs/formats/session.md):
//   y = black + gain t (a v R E' + dark),   var(y) = gain (y - black) + read_noise^2     (DN)
struct CameraCalibration {
  double black_dn = 0, saturation_dn = 0;
  double gain_dn_per_e = 1;
  double read_noise_dn = 0;
  double dark_current_e_per_s = 0;
  double prnu = 0;
  std::vector<double> responsivity_e_per_s_per_w_m2;  // per channel
  std::string cfa;  // colour mosaic (rig/cfa.h): all channels in one frame; empty: none
  std::vector<std::pair<int, int>> defects;  // (row, column)
  std::optional<core::Image> vignetting;     // relative sensitivity
};

// What calibrates the geometry, and the veiling glare (docs/how-to/calibrate.md).
struct CalibrationTargets {
  using Chessboard = rig::Chessboard;
  std::optional<Chessboard> board;  // on a flat sheet, in front of the camera; reflector rig
  int board_poses = 0;              // beside the one on I
  Chessboard mask;            // a transparency in the filter's holder, behind it a small source
  double spacer_m = 0;        // lifts the mask towards the source
  double spacer_shift_m = 0;  // rms per axis by which the mask lands beside its place on it
  int traps = 0;              // places of the light trap on I, evenly lit; reflector rig
};

// What stands in the light: the print, and where the image forms.
struct RigDescription {
  RigKind kind = RigKind::kLensless;
  double delta_m = 0;
  double albedo = 1;  // of the reflector
  bool dual = false;  // two prints, positive and negative part of the dual basis
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  double spacing_m = 0;
  double filter_scale = 1;
  std::array<double, 9> image_from_sensor{};  // row-major, docs/formats/session.md
  double pwm_hz = 0;                          // of the lamp; 0: none
  std::optional<CalibrationTargets> targets;
  CameraCalibration camera;
};

// "none", the lamp and its filter; "board on image plane", "board 1", ... "mask", "mask on spacer",
// "trap 1", ...
std::vector<std::string> TargetNames(const CalibrationTargets& targets);

// The filter centres a session is going to visit, in order, repeats included.
struct VisitPlan {
  int epoch = 0;
  std::vector<Vec2> filter_centres;
};

struct Devices {
  // Of a lab of real devices (hal/safety/watchdog.h); may be null. First, so that it outlives the
  // others.
  std::shared_ptr<Watchdog> watchdog;
  std::shared_ptr<core::Clock> clock;
  RigDescription rig;
  std::unique_ptr<Camera> camera;
  std::map<std::string, std::string> camera_settings;  // camera.settings of session.json
  std::map<std::string, std::string> lab_files;        // of session.json: field, SHA-256
  std::shared_ptr<Trigger> trigger;  // of the camera, which has it too; null: it has its own
  std::unique_ptr<Stage> stage;
  std::unique_ptr<Selector> shutter;  // "open", "closed": for darks
  std::unique_ptr<Selector> print;    // "plus", "minus"; null where there is one print
  std::unique_ptr<Selector> target;   // TargetNames: what stands in the light; null: none there is
  std::unique_ptr<Selector> colour;   // "Y", or "R", "G", "B"; null for one channel
  std::unique_ptr<Meter> monitor;     // lamp monitor; may be null
  std::unique_ptr<Supply> supply;     // may be null: the lamp is on
  std::unique_ptr<Inputs> inputs;     // may be null
  // Optional: told before a session what it will visit. A real rig needs no warning; the simulated
  // one traces the light for all visits together.
  std::function<void(const VisitPlan&)> announce;
};

}  // namespace luxfield::hal
