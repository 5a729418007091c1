// Chessboard corners in a camera's frame, to a few thousandths of a pixel, with their covariance.
//
// OpenCV finds the board; its sub-pixel refinement and its pixel convention are not used. About
// each corner p0 the signal is fitted by
//
//   S(p) = (1 + g.(p - p0)) (m + c erf(n1.(p - p0) / (sqrt(2) w1)) erf(n2.(p - p0) / (sqrt(2) w2)))
//
// with p0, the edges' normals n1 and n2, their widths, the levels m and c, and the shading g free:
// weighted least squares over a disc of pixels, variances from the sensor's noise model at the
// fitted signal, Gauss-Newton. Both the picture of a corner under any point-symmetric spread and
// the model are symmetric about p0, so that a wrong shape of the edges does not move it to first
// order (derived). What remains is the discreteness of the disc, and edges that the lens bends: up
// to 3e-3 pixel, coherent over the picture, where the distortion is 10 %. With the lens known, the
// fit runs in positions freed from its distortion, where edges are straight.
#pragma once

#include <optional>
#include <vector>

#include "luxfield/lightfield/geometry.h"
#include "luxfield/rig/chessboard.h"
#include "luxfield/rig/lens.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

struct Corner {
  int i = 0, j = 0;     // of the chessboard
  lightfield::Vec2 at;  // column and row, pixel edges at whole numbers
  double variance_x_px2 = 0, variance_y_px2 = 0, covariance_px2 = 0;  // of photon and read noise
};

// A frame as signal above black, with what is known of its noise.
struct SignalImage {
  int width = 0, height = 0;
  std::vector<float> signal_dn;
  std::vector<char> usable;  // neither defective nor saturated, of a mosaic green
  double gain_dn_per_e = 1, floor_variance_dn2 = 1, prnu = 0;

  double Variance(double signal) const;
};
// Of a colour mosaic only the green pixels count, where they are: half of all, evenly spread, of
// one colour, so that neither interpolation nor a lens' lateral colour moves a corner. The others
// show the mean of the greens around them, for OpenCV's search.
SignalImage MakeSignalImage(const session::RawFrame& frame, const rig::SensorModel& sensor);

// Corner (i, j) near `start`, with the steps on the image to (i + 1, j) and (i, j + 1). Nothing
// where the disc (a radius of 7 pixels, less where the cells are small) leaves the image or cells
// are below 7 pixels, the fit does not converge, or contrast is lost. `lens`, if known, straightens
// the edges.
std::optional<Corner> RefineCorner(const SignalImage& image, lightfield::Vec2 start,
                                   lightfield::Vec2 step_i, lightfield::Vec2 step_j,
                                   const rig::Lens* lens = nullptr);

// All corners of the board, without those that could not be refined. `mirrored`: the picture shows
// (i, j) left-handed against (column, row), as that of a transparency from behind. Empty if OpenCV
// does not find the whole board.
std::vector<Corner> FindChessboard(const SignalImage& image, const rig::Chessboard& chessboard,
                                   bool mirrored);

// The same corners once more, with a lens that straightens the edges about them.
std::vector<Corner> RefineCorners(const SignalImage& image, const std::vector<Corner>& corners,
                                  const rig::Lens& lens);

}  // namespace luxfield::reconstruct
