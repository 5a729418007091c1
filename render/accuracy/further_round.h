// The samples that a picture still lacks, pixel by pixel.
//
// A picture whose pixel i has n_i samples of the variance s_i^2 is to reach the mean variance V:
//
//   least sum_i m_i  with  1 / N sum_i (n_i s_i^2 + m_i^2 v_i(m_i)) / (n_i + m_i)^2 <= V
//
// for m_i further samples of the variance v_i(m). Without what is there, n_i + m_i ~ s_i is the
// answer (Neyman 1934), and so n_i + m_i = max(n_i, c s_i) is taken, with m_i in powers of two. A
// pixel that has enough is left out of the round.
//
// s_i comes from the pixel's neighbours alone, never from its own samples: these say nothing of m_i,
// and the mean of both by their numbers is as unbiased as each of them (Kirk and Arvo 1991 on the
// bias of a pixel that asks itself).
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/render/accuracy/picture_noise.h"
#include "luxfield/render/film/frame.h"

namespace luxfield::render {

struct FurtherAim {
  double variance = 0;  // mean over all pixels, of the merged picture
  int unit = 2;         // samples that a pixel takes at least, if it takes any
  double least = 2;     // samples of each pixel that hits something, with those that it has
  double most = 1 << 20;
};

struct FurtherRound {
  // RenderOptions::sample_density and samples_per_pixel; 0 where nothing is lacking.
  core::Image density;
  int samples_per_pixel = 0;
  double samples = 0;   // mean over the pixels that hit something
  double lit = 0;       // share of them that take any
  double variance = 0;  // expected of the merged picture, mean over all pixels
};

// `taken`: samples of each pixel of `frame`, one channel, not 0 everywhere; pixels of none may be
// black. `law` says how the variance falls with the samples.
FurtherRound PlanFurtherRound(const Frame& frame, const core::Image& taken, const VarianceLaw& law,
                              const FurtherAim& aim);

// Samples that the round adds to each pixel that hits something, in expectation.
core::Image SamplesOf(const FurtherRound& round);

}  // namespace luxfield::render
