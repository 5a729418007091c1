// What a stack of pictures says about a response: codes of the same places under all exposures.
#pragma once

#include <vector>

#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

namespace luxfield::reconstruct {

struct ResponseSamples {
  int exposures = 0;
  std::vector<std::uint16_t> code;   // [sample][exposure]
  std::vector<std::uint8_t> usable;  // likewise; 0: black or saturated

  int count() const { return exposures ? static_cast<int>(code.size()) / exposures : 0; }
  std::size_t index(int sample, int exposure) const {
    return static_cast<std::size_t>(sample) * exposures + exposure;
  }
};

// The code that clips: the largest of the stack where at least 100 samples share it (a camera of
// 12 bits in files of 16), else the files' own.
double FindSaturationCode(const PictureStack& stack);

// Middle pixels of flat blocks of 3 x 3, at most about `count`, spread evenly over the sum of their
// codes, and in each part of it those of the flattest blocks: edges that move between pictures or
// ring from compression tell nothing. Flatness has no sign, so it selects no noise of one. Single
// pixels and no means, which would smear the curve over the codes of a block. Not usable: exposures
// with a pixel of the block at 0 or saturated.
ResponseSamples FlatSamples(const PictureStack& stack, int channel, double saturation_code,
                            int count);

// `count` single pixels, chosen evenly over the picture without looking at them.
ResponseSamples PixelSamples(const PictureStack& stack, int channel, double saturation_code,
                             int count);

// Equal quantiles of the pictures' histograms (Grossberg & Nayar, PAMI 2003): for `count` levels u
// from 0 to 1 the code whose cumulative share is nearest to u. Needs no alignment, but samples are
// not independent. For 8-bit pictures.
ResponseSamples HistogramSamples(const PictureStack& stack, int channel, int count);

}  // namespace luxfield::reconstruct
