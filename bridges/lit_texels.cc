#include "luxfield/bridges/lit_texels.h"

#include <algorithm>
#include <cmath>

namespace luxfield::bridges {

Survey SurveyOf(const lightfield::LightField& field) {
  const auto& g = field.geometry;
  Survey survey;
  survey.shines.assign(static_cast<std::size_t>(g.grid.count()), false);
  int row0 = g.lattice.height, row1 = -1, column0 = g.lattice.width, column1 = -1;
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < g.channels; ++channel) {
      const auto image = field.image(m, channel);
      for (int row = 0; row < g.lattice.height; ++row)
        for (int column = 0; column < g.lattice.width; ++column) {
          const double c = image[static_cast<std::size_t>(row) * g.lattice.width + column];
          if (c == 0) continue;
          (c > 0 ? survey.positive : survey.negative) += std::abs(c);
          survey.shines[static_cast<std::size_t>(m)] = true;
          row0 = std::min(row0, row), row1 = std::max(row1, row);
          column0 = std::min(column0, column), column1 = std::max(column1, column);
        }
    }
  if (row1 >= 0) survey.lit = {row0, row1 + 1, column0, column1 + 1};
  return survey;
}

}  // namespace luxfield::bridges
