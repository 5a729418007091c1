// How noisy a sampled picture is, how well that is known, and how it falls with the samples.
#pragma once

#include <map>

#include "luxfield/render/renderer.h"

namespace luxfield::render {

// Of the luminance, as a frame states it: from the spread between its passes, or within one.
struct PictureNoise {
  double mean_luminance = 0;
  double mean_variance = 0;  // of a pixel; the expected squared error of the frame
  // About (sum v)^2 / sum v^2 over the pixels' true variances v: how many pixels of equal noise
  // would let the sum scatter as much.
  double effective_pixels = 0;
  int degrees = 1;  // of freedom of a pixel's variance: passes - 1, or samples - 1 of one pass
  // A factor that all variances were corrected by, and the variance of its logarithm; of `variance`
  // the frame's own. Without it they are bounds where it is below 1.
  double scale = 1, scale_log_variance = 0;

  double RelativeError() const;  // expected RMSE over the mean luminance
  // Relative standard deviation of that estimate. Where few pixels hold the noise, what they state
  // scatters as much as they do.
  double Sigma() const;
  // The true mean squared error is at most this many times mean_variance in about 95 % of cases (92
  // to 98 with 20 to 2000 effective pixels): of n of them the squared errors' sum scatters by
  // sqrt(2 / n) of itself, that of variances by sqrt(2 / (n degrees)), if noise is normal; with the
  // factor's scatter their ratio is about chi-squared over its degrees of freedom (Wilson and
  // Hilferty 1931).
  double Margin() const;
};

// Estimated variances v have E v^2 = (1 + 2 / degrees) (E v)^2 if noise is normal, which
// effective_pixels takes off; less so where few pixels hold the noise and a lucky draw of those
// would make them seem many.
PictureNoise NoiseOf(const Frame& frame, int degrees,
                     core::Image Frame::*variance = &Frame::variance);

// v(k), the mean variance of a pass of k samples: log-log between measured points, with the slopes
// of the outer ones beyond them, of which no power law asks more than of 0.8 to 2.
struct VarianceLaw {
  std::map<double, double> points;  // k -> v
  double scale = 1;                 // of the picture's variance over the points'

  void Add(double k, double v);  // v <= 0 is left out
  double Of(double k) const;     // 0 without points
  // Makes v the value at k by the scale.
  void Anchor(double k, double v);
};

}  // namespace luxfield::render
