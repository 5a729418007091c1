#include "luxfield/render/film/neighbours.h"

#include <algorithm>

namespace luxfield::render {

double MeanAround(const core::Image& values, const core::Image& counted, int row, int column,
                  const Neighbours& neighbours) {
  const int reach = neighbours.reach;
  double sum = 0, count = 0;
  for (int r = std::max(0, row - reach); r <= std::min(values.height - 1, row + reach); ++r)
    for (int c = std::max(0, column - reach); c <= std::min(values.width - 1, column + reach); ++c)
      if (counted.at(0, r, c) > 0 && (neighbours.itself || r != row || c != column)) {
        sum += values.at(0, r, c);
        ++count;
      }
  return count > 0 ? sum / count : 0;
}

}  // namespace luxfield::render
