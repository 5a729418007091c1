// Where the scale of false colours or of a histogram has its marks, and which of them have a label.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "luxfield/view/picture/layer.h"

namespace luxfield::view {

struct Tick {
  double position = 0, value = 0;  // 0 at the scale's lowest value, 1 at its highest
  int rank = 0;                    // marks of higher ranks are labelled first
};

// 1, 2 and 5 of every decade, of which 1 ranks highest and decades of a multiple of 2 and 4 above it;
// of linear scales every tenth, of which the ends rank highest and every second next. The ends alone of
// a scale that holds fewer than two of them.
std::vector<Tick> TicksOf(const render::FalseColourScale& scale, Layer layer);

struct TickText {
  double left = 0;  // from the scale's lower end, in the unit of widths
  std::string text;
};

// Labels (render::TickLabels) of a scale of that width: those of the lowest rank whose labels, and those
// of the ranks above it, all have room `gap` apart, centred below their marks and within the width.
std::vector<TickText> TextsOf(const std::vector<Tick>& ticks, double width, double gap,
                              const std::function<double(const std::string&)>& width_of);

}  // namespace luxfield::view
