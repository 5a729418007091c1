// A histogram as it stands on a panel.
#pragma once

#include <optional>
#include <string>

#include "luxfield/view/picture/histogram.h"

namespace luxfield::view {

// Into the ImGui window that is begun: bars over the logarithm of the value, which is in `unit`, with
// ticks; the pointer reads a bar. `white` marks a value, where that is shown.
void DrawHistogramPlot(const Histogram& histogram, const std::string& unit,
                       const std::optional<double>& white);

}  // namespace luxfield::view
