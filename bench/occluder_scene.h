// A scene of ours for shadows of a lamp: things of many widths between it and a wall.
#pragma once

#include "luxfield/scene/scene.h"

namespace luxfield::bench {

// A floor, and a wall at z = 6 m, behind a post at 0.45 m, slats at 1.2 m, boxes, a pole and a board
// from 2 to 4.8 m, all Lambertian; the lamp stands at the origin and shines along +z, y is up.
scene::Geometry OccluderScene();

// From beside and above the lamp; `step` centimetres along a flight past the things, which it keeps
// looking at.
scene::Camera OccluderCamera(int width, int height, int step = 0);

}  // namespace luxfield::bench
