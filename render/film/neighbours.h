// Means over a pixel's neighbours: what a pixel's few samples hardly know of its noise, those around
// it tell.
#pragma once

#include "luxfield/core/image.h"

namespace luxfield::render {

struct Neighbours {
  int reach = 1;       // columns and rows either way
  bool itself = true;  // whether the pixel counts too
};

// Mean of the first channel of `values` over the neighbours of a pixel where `counted`, one channel
// of the same size, is above 0; 0 if there are none.
double MeanAround(const core::Image& values, const core::Image& counted, int row, int column,
                  const Neighbours& neighbours = {});

}  // namespace luxfield::render
