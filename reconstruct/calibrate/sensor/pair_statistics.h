// Two frames of one scene and exposure -> the numbers that sensor calibration needs, and the pixels
// it must leave out.
//
// y_ka = s_k + n_ka: pixel k of frame a holds a fixed pattern s_k (shading, PRNU, dark pattern) and
// noise n_ka, independent between frames and pixels. The difference of two frames has no fixed
// pattern (Janesick, Photon Transfer, SPIE 2007; EMVA 1288 R4 Linear 6.6):
//
//   var_k(A - B) / 2 = temporal variance
//
// and a product of the two frames' local deviations has no noise:
//
//   E[h(A) h(B)] = |h|^2 var(s_k),   h(y) = y - mean of the 4 neighbours, |h|^2 = 5/4
//
// h removes any linear shading; a pattern that is constant along rows or columns counts by 0.3.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

// Pixels that count: 1; defects: 0. Row-major, the sensor's size.
using PixelMask = std::vector<std::uint8_t>;

// Sample moments over the pixels that count (divisor n - 1), DN. Sums in double about a pivot, a
// row at a time in a fixed order: relative rounding 1e-16 times the square of (range / noise), at
// most 1e-7 at 16 bit, and independent of threads.
struct PairStatistics {
  bool dark = false;  // shutter closed
  int channel = 0;
  bool overflown = false;  // of a mosaic: another colour of the frames is saturated
  double exposure_s = 0;
  double meter_a = 0, meter_b = 0;  // lamp monitor during each frame; 0: none
  std::size_t pixels = 0;
  double mean_a = 0, mean_b = 0;
  double variance_a = 0, variance_b = 0, covariance = 0;
  double min_dn = 0, max_dn = 0;  // of both frames
  double share_at_max = 0;        // of the samples: holds the value max_dn
  bool quantised = true;          // whole DN

  double mean() const { return 0.5 * (mean_a + mean_b); }
  // var(A - ratio B) / (1 + ratio^2): the temporal variance where the light of A is `ratio` times
  // that of B, without their common pattern.
  double TemporalVariance(double ratio) const {
    return (variance_a + ratio * ratio * variance_b - 2 * ratio * covariance) / (1 + ratio * ratio);
  }
};

// Fills all but dark, channel, overflown, exposure_s and the meters. Throws InputError for frames
// that differ in size or kind of number or do not have the mask's size, and for fewer than 100
// pixels.
PairStatistics MeasurePair(const session::RawFrame& a, const session::RawFrame& b,
                           const PixelMask& mask);

// Pixels whose value in (A + B) / 2 lies further than `threshold` robust standard deviations
// (1.4826 times the median absolute deviation, at least half a DN for whole numbers) from the
// median of their up to 8 neighbours: hot pixels of darks, dead and bright ones of flats. Six
// sigmas take 2e-9 of good pixels, which changes a variance by less than 1e-7. Returns (row,
// column), row-major. Memory: three floats a pixel.
std::vector<std::pair<int, int>> FindOutliers(const session::RawFrame& a,
                                              const session::RawFrame& b, double threshold = 6);

// PRNU^2, the relative variance of the pixels' sensitivity, from flats A, B and darks of the same
// exposure (subtracted, so that the dark pattern does not count):
//
//   prnu^2 = H / (S - H),   H = mean h(A') h(B') / |h|^2,   S = mean A' B'
//
// over pixels whose 4 neighbours count as well. Unbiased to first order in prnu^2; the variance of
// H is (R / n) ((p + n)^2 + p^2), with p, n the pattern's and the noise's variance and R = 1.69 for
// the overlap of the stencils (the sum of h's squared autocorrelation over |h|^4). Negative where
// noise exceeds the pattern: keep it, it is unbiased.
struct PatternVariance {
  double value = 0, sigma = 0;
};
PatternVariance MeasurePrnuSquared(const session::RawFrame& flat_a, const session::RawFrame& flat_b,
                                   const session::RawFrame& dark_a, const session::RawFrame& dark_b,
                                   const PixelMask& mask);

}  // namespace luxfield::reconstruct
