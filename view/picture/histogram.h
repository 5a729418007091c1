// How often a picture has which luminance.
#pragma once

#include <vector>

#include "luxfield/render/film/frame.h"

namespace luxfield::view {

struct Histogram {
  // Shares of all pixels, in bins that are equally wide in the logarithm from min to max.
  std::vector<float> shares;
  double min = 0, max = 0;  // five decades up to the largest value; both 0: nothing is above 0
  double median = 0, percentile_99 = 0;  // of the positive values
  double mean = 0;                       // of all
  double dark = 0;                       // share of pixels that are 0 or below
  double below = 0;                      // share of positive ones below min, which no bin counts
};

Histogram HistogramOf(const core::Image& image, int bins = 96);

}  // namespace luxfield::view
