// Where a picture's samples go: in proportion to the noise that one of them leaves.
//
// The squared error of a picture whose pixel i takes n_i samples is sum_i s_i^2 / n_i; of all ways
// to deal out sum_i n_i, n_i ~ s_i leaves least (Neyman 1934): (sum_i s_i)^2 instead of
// N sum_i s_i^2 for even samples. Where receivers close to a lamp hold nearly all of the noise this
// is most of the time.
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/render/renderer.h"

namespace luxfield::render {

struct SampleDensity {
  core::Image density;  // RenderOptions::sample_density; powers of two
  double mean = 1;      // over the pixels that hit something: samples taken over those of 1 each
  double variance = 1;  // of the picture over that of even samples, as `frame` expects it
  double variance_of_one = 0;  // of a pixel of one even sample, by `frame`: mean over all pixels
};

// From a frame whose samples must not be the picture's. Its variances, times samples, are averaged
// over 3 x 3 pixels, as each of them hardly knows its own; what they miss, the squared luminance
// shows to a quarter, as noise is mostly relative. Densities from `least` (at most 1) to 256.
SampleDensity DensityFrom(const Frame& frame, double least);

}  // namespace luxfield::render
