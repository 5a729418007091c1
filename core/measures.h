// How far one image is from another (docs/theory.md 10).
#pragma once

#include "luxfield/core/image.h"

namespace luxfield::core {

struct Difference {
  double rel_rmse = 0;  // RMSE / mean(reference), all channels
  double rel_mse = 0;   // mean((a - b)^2 / (b^2 + eps)), eps = (0.01 mean b)^2
  double bias = 0;      // mean(a - b) / mean(b)
  double max_abs = 0;   // largest |a - b|
  double mean_lab =
      0;  // mean CIE 1976 difference after the exponential operator, k = 1, L_avg of b
  double mean_reference = 0;
};

// a against the reference b: same size, 1 or 3 channels each (1 is grey). Sums in double.
// Throws InputError if sizes differ or a value is not finite.
Difference Compare(const Image& a, const Image& b);

// The luminance of each pixel, 1 channel (core/colour.h); of 1 or 3 channels.
Image LuminanceImage(const Image& image);

// Per-pixel CIE 1976 difference, the picture behind mean_lab.
Image LabDifference(const Image& a, const Image& b);

}  // namespace luxfield::core
