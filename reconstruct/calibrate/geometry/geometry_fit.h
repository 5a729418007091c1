// Chessboard corners in many views -> where the parts of the bench stand (docs/theory.md 3,
// "Geometry from shadows").
//
// Frame of I: origin at the foot of the perpendicular from the filter's centre, s along the
// projection of the filter's u axis, z along the light. Unknown, all solved together (Ceres):
//
//   lens            fx, fy, cx, cy, k1, k2, p1, p2 (rig/lens.h); reflector rig
//   board n         its pose before the camera; board 0 lies on I, and carries the plane's
//                   coordinates P (lensless: the sensor does, P = pitch (column, row))
//   plane           q = o + R(phi) diag(1, side) P, side = 1 seen from the lamp, -1 from behind
//   filter          delta, tilt: axes Ry(b) Rx(a), centre (0, 0, -delta)
//   source          S, where the small source stands with the stage at (0, 0)
//   stage           two vectors: how far the filter moves against the luminaire per unit of u and
//                   v; at set point c the source stands at S - [a_u a_v] c - e,
//                   e ~ N(0, repeatability^2)
//   spacer          where the mask landed on it: shift ~ N(0, spacer_shift^2), turn free
//
// The shadow of a point m of the mask is the point of I on the line from the source through it. The
// magnifications with and without the spacer give the distances:
//
//   M' / M = D / (D - spacer),   delta = D (M - 1)
//
// Each corner counts with the covariance that its own fit has, times one factor for the boards and
// one for the mask, so that chi^2 of either is its number of degrees of freedom: the noise of
// detection is what the residuals show. Sigmas come from the Jacobian that Ceres leaves, to first
// order. Corners beyond 5 sigma are left out and counted.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/reconstruct/calibrate/geometry/chessboard_corners.h"
#include "luxfield/rig/chessboard.h"
#include "luxfield/rig/homography.h"
#include "luxfield/rig/lens.h"

namespace luxfield::reconstruct {

// Corners of one frame.
struct ChessboardView {
  std::string file;
  bool mask = false;       // its shadow on I; else the board
  int board = 0;           // pose; 0: on I
  bool on_spacer = false;  // the mask
  lightfield::Vec2 setpoint_m;
  int arrival = 0;  // counts moves of the stage: views of one arrival share its error
  std::vector<Corner> corners;
};

struct GeometryTargets {
  std::optional<rig::Chessboard> board;  // reflector rig
  rig::Chessboard mask;
  double spacer_m = 0, spacer_shift_m = 0;
  double stage_repeatability_m = 0;  // rms per axis and arrival
};

struct GeometryParameter {
  std::string name, unit;
  double value = 0, sigma = 0;
};

struct ViewResidual {
  int i = 0, j = 0;
  lightfield::Vec2 at, residual_px;  // seen - predicted
  double sigma_px = 0;               // of the detection, mean of both axes
  bool left_out = false;
};

// How well one kind of target was seen.
struct DetectionNoise {
  int corners = 0, left_out = 0;
  double rms_px = 0;     // of the residuals, per axis
  double predicted = 0;  // the same from the frames' noise alone
  double factor = 0;     // on all sigmas of the corners, from chi^2 per degree of freedom
  double degrees = 0;
};

struct Geometry {
  int width = 0, height = 0;
  std::optional<rig::Lens> lens;
  rig::Homography image_from_sensor;  // of pixel positions freed from distortion; [8] = 1
  double delta_m = 0;
  lightfield::Vec2 filter_tilt_rad;
  std::array<lightfield::Vec3, 2> stage_axes;
  // Every figure with its sigma, and the covariance of all (row-major).
  std::vector<GeometryParameter> parameters;
  std::vector<double> covariance;
  // sigma of the place on I that the sensor's corners and middle see, metres, in s and t: errors of
  // the lens, the camera's pose and the filter's axis together.
  std::array<lightfield::Vec2, 5> place_sigma_m;
  DetectionNoise boards, masks;
  double chi_squared = 0, degrees = 0;               // of the whole fit, factors applied
  std::vector<std::vector<ViewResidual>> residuals;  // of each view
};

// `image_from_sensor` as the session states it: which side the camera is on, and on the lensless
// rig the pixels' pitch; nothing else of it is used. Throws InputError where the views do not
// determine the geometry: fewer than 3 boards or none on I, no mask on or off the spacer, a stage
// that moved along fewer than two directions.
Geometry FitGeometry(const GeometryTargets& targets, const std::vector<ChessboardView>& views,
                     int width, int height, const rig::Homography& image_from_sensor);

}  // namespace luxfield::reconstruct
