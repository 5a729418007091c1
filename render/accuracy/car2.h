// The bench scene `car2`: a synthetic headlight and an analytic street, without files.
#pragma once

#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/scene/gbuffer.h"

namespace luxfield::render {

// A headlight like the thesis' car2: 11 x 9 images 256^2 at a spacing of 16.5 mm, delta 0.3 m,
// image plane 0.6 m wide; a low beam with a cut-off, a hot spot, facets and a floor, six decades.
// Synthetic, ours.
struct SyntheticCar2Options {
  int grid_width = 11, grid_height = 9;
  int size = 256;    // square images
  int channels = 1;  // 3: chips of slightly different white
};
lightfield::LightField SyntheticCar2(const SyntheticCar2Options& options = {});

// What a camera beside the headlight sees, analytically: road, wall at 10 m, spheres and a box from
// 0.5 m on.
GBuffer RoadGBuffer(const Device& device, int width, int height);

}  // namespace luxfield::render
