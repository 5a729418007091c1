// What a stack of pictures says about a response: codes of the same places under all exposures.
#pragma once

#include <vector>

#include "reconstruct/picture_stack.h"

namespace luxfield::reconstruct {

struct ResponseSamples {
  int exposures = 0;
  int pixels = 1;                   // that make one sample
  std::vector<float> code;          // [sample][exposure], their mean; negative: cannot be used
  std::vector<std::uint16_t> each;  // [sample][exposure][pixel]

  int count() const { return exposures ? static_cast<int>(code.size()) / exposures : 0; }
  double at(int sample, int exposure) const {
    return code[static_cast<std::size_t>(sample) * exposures + exposure];
  }
};

// The code that clips: the largest of the stack where at least 100 samples share it (a camera of
// 12 bits in files of 16), else the files' own.
double FindSaturationCode(const PictureStack& stack);

// Blocks of 3 x 3 pixels, at most about `count` of them, spread evenly over the sum of their codes,
// and in each part of it the flattest: edges that move between pictures or ring from compression
// tell nothing. A block's mean and its spread are independent, so flatness does not select noise.
// Not usable: a block with a pixel at 0 or saturated.
ResponseSamples BlockSamples(const PictureStack& stack, int channel, double saturation_code,
                             int count);

// `count` single pixels, chosen evenly over the picture without looking at them.
ResponseSamples PixelSamples(const PictureStack& stack, int channel, double saturation_code,
                             int count);

// Equal quantiles of the pictures' histograms (Grossberg & Nayar, PAMI 2003): for `count` levels u
// from 0 to 1 the code whose cumulative share is nearest to u. Needs no alignment, but samples are
// not independent. For 8-bit pictures.
ResponseSamples HistogramSamples(const PictureStack& stack, int channel, int count);

}  // namespace luxfield::reconstruct
