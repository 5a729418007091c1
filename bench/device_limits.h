// What bounds the estimators of a light field on a device, measured in the same run as they are.
#pragma once

#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/scene/gbuffer.h"

namespace luxfield::bench {

// The multiply-adds of one channel that `exact` makes at least for the pixels of a G-buffer in the
// luminaire's frame: two for every texel that a pixel sees through the support of its image
// (docs/theory.md 7.1),
//
//   2 sum_pixels (sum_i texels seen along u through B_i) (sum_j texels seen along v through B_j).
//
// Counted at `sample` pixels, evenly spread, and scaled to all.
double ExactMultiplyAdds(const lightfield::LightField& field, const render::GBuffer& gbuffer,
                         std::size_t sample = 2000);

// Multiply-adds of float32 a second that the device makes out of registers, per core on a CPU and
// all of it on a GPU; the best of some runs.
double MultiplyAddsPerSecond(const render::Device& device);

// Seconds, core-seconds on a CPU, to read the position and the normal of every pixel and to add to
// its irradiance: 64 bytes a pixel. The median of some runs.
double GBufferPassSeconds(const render::Device& device, const render::GBuffer& gbuffer);

}  // namespace luxfield::bench
