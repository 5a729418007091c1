// Other programs that find a response curve and merge a stack with it: OpenCV's photo module, and
// pfshdrcalibrate of pfstools where it is installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/reconstruct/calibrate/response/picture_stack.h"

namespace luxfield::bench {

struct ForeignMerge {
  std::string name;
  std::string refused;          // why there is no picture; empty: there is one
  std::vector<float> radiance;  // in a unit of its own
  std::vector<double> curve;    // I at codes 0 to 255 in a unit of its own; empty: not told
  double calibrate_s = 0;       // 0: in merge_s
  double merge_s = 0;
};

// One channel, as grey pictures with the exposure times of the stack, all at their defaults:
// `OpenCV Debevec` and `OpenCV Robertson` (8 bits alone), `pfstools Robertson`, `pfstools
// Mitsunaga`. `folder` takes the latter's streams.
std::vector<ForeignMerge> MergeWithOthers(const reconstruct::PictureStack& stack, int channel,
                                          const std::filesystem::path& folder);

}  // namespace luxfield::bench
