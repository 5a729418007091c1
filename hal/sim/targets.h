// Pictures of the calibration targets: a chessboard sheet before the camera, the shadow of a
// chessboard transparency that a small source throws on I, a light trap on an evenly lit I, and the
// filter in its holder (filter_bench.h).
//
// A chessboard is a plane, so that each picture is a chessboard under one projective map of the
// lens' rays. The pattern is blurred in closed form, along each of its axes by the camera's point
// spread and the source's disc, and averaged over 3 x 3 points of every pixel. Both blurs are
// symmetric about a corner and the same at every place within a pixel, so that the picture does not
// move it: what is left is the lens' distortion taken as linear within a pixel, below 1e-4 pixel.
#pragma once

#include <vector>

#include "luxfield/hal/sim/lab_description.h"

namespace luxfield::hal::sim {

struct TargetShot {
  int target = 0;     // index into TargetPositions, above 0
  Vec3 source_shift;  // of the source from its place at home, frame of I: -(stage_axes c)
  Vec2 spacer_shift;  // where the mask landed on its spacer
};

// "none", the lab's targets and the views of its filter's bench.
std::vector<std::string> TargetPositions(const LabDescription& lab);

// E' of every pixel: what room or source light gives at the sensor (docs/formats/session.md).
std::vector<float> PictureOfTarget(const LabDescription& lab, const TargetShot& shot);

// x_camera = rotation * x_board + translation, of the n-th board (0: on I). The board's x points
// right and its y down where one faces its front, the origin is corner (0, 0). Poses depend on the
// seed: tilted up to 40 degrees, 0.55 to 0.95 of the way to I, wholly in the picture. Throws
// InputError if the board does not fit.
struct BoardPose {
  Rotation rotation{};
  Vec3 translation;
};
BoardPose PoseOfBoard(const LabDescription& lab, int board);

}  // namespace luxfield::hal::sim
