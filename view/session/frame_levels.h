// What a frame of a session shows: how often each level occurs, and the picture in small.
#pragma once

#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::view {

struct FrameLevels {
  std::string file;            // as the journal names it
  std::vector<double> counts;  // of pixels, in bins of equal width from 0 to `top`
  // Of the scale: the least 2^n - 1, from 255, that no pixel exceeds; of floating-point frames the
  // largest value.
  double top = 0;
  core::Image small;  // one channel: the mean levels of squares of pixels, over `top`
};

// Of its pixels as they are; `most_side` bounds both sides of `small`.
FrameLevels LevelsOf(const session::RawFrame& frame, const std::string& file, int bins = 64,
                     int most_side = 256);

}  // namespace luxfield::view
