// How many samples each light of a picture takes: lights are sampled independently of each other,
// so that their variances add up, as their times do.
//
//   least  sum_l t_l(n_l)  with  sum_l v_l(n_l) <= V,    t_l(n) = fixed_l + n s_l
//
// At the optimum a second more spent on any light takes the same off the variance:
// -v_l'(n_l) / s_l is the same for all l. For v_l = a_l / n_l that is n_l ~ sqrt(a_l / s_l)
// (Neyman 1934, with costs).
#pragma once

#include <span>
#include <vector>

#include "luxfield/render/accuracy/picture_noise.h"

namespace luxfield::render {

// What a light's samples leave and cost.
struct LightLaw {
  VarianceLaw variance;  // of a pixel's luminance, mean over the pixels; of one point per pixel
  double fixed_s = 0, sample_s = 0;  // of the picture, and of one sample per pixel
  int points = 1;                    // surface points of a pixel, over which its samples are dealt
  double least = 2;                  // samples

  double Variance(double samples) const { return variance.Of(samples / points) / points; }
  double Seconds(double samples) const { return fixed_s + samples * sample_s; }
};

// Of all lights together.
double VarianceOf(std::span<const LightLaw> lights, std::span<const double> samples);
double SecondsOf(std::span<const LightLaw> lights, std::span<const double> samples);

// Samples per pixel of each light that leave at most this variance in the least time; whole
// numbers, at least LightLaw::least and at most 2^20, which may not be enough.
std::vector<double> SamplesForVariance(std::span<const LightLaw> lights, double variance);

// The same that leave the least variance within so many seconds; the least of each light where even
// those take longer.
std::vector<double> SamplesForSeconds(std::span<const LightLaw> lights, double seconds);

}  // namespace luxfield::render
