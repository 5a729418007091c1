#include "luxfield/view/session/frame_levels.h"

#include <algorithm>

namespace luxfield::view {

FrameLevels LevelsOf(const session::RawFrame& frame, const std::string& file, int bins,
                     int most_side) {
  FrameLevels levels;
  levels.file = file;
  double brightest = 0;
  for (std::size_t k = 0; k < frame.size(); ++k)
    brightest = std::max(brightest, double{frame.at(k)});
  levels.top = brightest;
  if (frame.value.empty())
    for (levels.top = 255; levels.top < brightest;) levels.top = 2 * levels.top + 1;
  if (!(levels.top > 0)) levels.top = 1;
  levels.counts.assign(static_cast<std::size_t>(bins), 0);
  const double of_bin = levels.top * (1 + 1e-9) / bins;
  for (std::size_t k = 0; k < frame.size(); ++k)
    ++levels.counts[static_cast<std::size_t>(
        std::clamp(double{frame.at(k)} / of_bin, 0.0, bins - 1.0))];
  const int shrink = (std::max(frame.width, frame.height) + most_side - 1) / most_side;
  levels.small =
      core::Image((frame.width + shrink - 1) / shrink, (frame.height + shrink - 1) / shrink, 1);
  core::Image pixels = levels.small;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      levels.small.at(0, row / shrink, column / shrink) +=
          frame.at(static_cast<std::size_t>(row) * frame.width + column);
      ++pixels.at(0, row / shrink, column / shrink);
    }
  for (std::size_t k = 0; k < pixels.data.size(); ++k)
    levels.small.data[k] /= pixels.data[k] * static_cast<float>(levels.top);
  return levels;
}

}  // namespace luxfield::view
