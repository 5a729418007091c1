// A bench as its parts are known: what stands in the light, and where the image forms.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/rig/chessboard.h"
#include "luxfield/rig/homography.h"
#include "luxfield/rig/rig_kind.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::rig {

// What calibrates the geometry, and the veiling glare (docs/how-to/calibrate.md).
struct CalibrationTargets {
  std::optional<Chessboard> board;  // on a flat sheet, in front of the camera; reflector rig
  int board_poses = 0;              // beside the one on I
  Chessboard mask;            // a transparency in the filter's holder, behind it a small source
  double spacer_m = 0;        // lifts the mask towards the source
  double spacer_shift_m = 0;  // rms per axis by which the mask lands beside its place on it
  int traps = 0;              // places of the light trap on I, evenly lit; reflector rig
};

struct RigDescription {
  RigKind kind = RigKind::kLensless;
  double delta_m = 0;
  double albedo = 1;  // of the reflector
  bool dual = false;  // two prints, positive and negative part of the dual basis
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  double spacing_m = 0;
  double filter_scale = 1;
  Homography image_from_sensor;  // docs/formats/session.md
  double pwm_hz = 0;             // of the lamp; 0: none
  std::optional<CalibrationTargets> targets;
  SensorModel camera;  // but for width, height and bits, which the opened camera tells
};

// "none", the lamp and its filter; "board on image plane", "board 1", ... "mask", "mask on spacer",
// "trap 1", ...
std::vector<std::string> TargetNames(const CalibrationTargets& targets);

}  // namespace luxfield::rig
