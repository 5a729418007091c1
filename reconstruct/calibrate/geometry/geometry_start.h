// What the geometry's fit moves, and where it starts.
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "luxfield/reconstruct/calibrate/geometry/geometry_fit.h"
#include "luxfield/rig/homography.h"

namespace luxfield::reconstruct {

// The unknowns of geometry_fit.h, metres and radians.
struct GeometryState {
  bool has_lens = false;
  double side = 1;
  lightfield::Vec2 pitch_m;                     // lensless
  std::array<double, 8> lens{};                 // fx, fy, cx, cy, k1, k2, p1, p2
  std::map<int, std::array<double, 6>> boards;  // x_camera from x_board: angle-axis, translation
  std::array<double, 3> plane{};                // o, phi
  std::array<double, 3> filter{};               // delta, a, b
  std::array<double, 3> source{};               // from the filter's centre
  std::array<double, 6> stage{};                // a_u, a_v
  std::array<double, 3> spacer{};               // shift, turn
  std::map<int, std::array<double, 2>> arrivals;

  // Every unknown with its size, always in this order.
  std::vector<std::pair<double*, int>> Blocks();
};

rig::Lens LensOf(const GeometryState& state);

// The side of I that a camera with this mapping stands on (geometry_fit.h): 1 or -1.
double StatedSide(const rig::Homography& image_from_sensor);

// From detections alone, but for the side of the camera and the pixels' pitch (geometry_fit.h):
// lens and boards by OpenCV's calibration (Zhang 2000), then with filter and stage parallel to I
// the magnifications give the distances and the middles of the shadows, linearly, the filter's axis
// and the source. Throws InputError as FitGeometry.
GeometryState StartGeometry(const GeometryTargets& targets,
                            const std::vector<ChessboardView>& views, int width, int height,
                            const rig::Homography& image_from_sensor);

// Pixel position of a corner of a view.
lightfield::Vec2 Predict(const GeometryTargets& targets, const GeometryState& state,
                         const ChessboardView& view, const Corner& corner);

}  // namespace luxfield::reconstruct
