// Which texels and images of a light field hold light.
#pragma once

#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::bridges {

// Rows and columns [first, end) outside of which all coefficients are zero; none if all are.
struct LitTexels {
  int first_row = 0, end_row = 0, first_column = 0, end_column = 0;

  int rows() const { return end_row - first_row; }
  int columns() const { return end_column - first_column; }
};

struct Survey {
  LitTexels lit;
  std::vector<bool> shines;           // whether image m has light
  double positive = 0, negative = 0;  // sums of the coefficients' sizes
};

Survey SurveyOf(const lightfield::LightField& field);

// Flux per coefficient, m^4 sr: the integral of a basis function times a texel's area.
inline double FluxOfCoefficient(const lightfield::LuminaireGeometry& g) {
  return g.grid.PhiIntegral() * g.lattice.texel_area_m2();
}

}  // namespace luxfield::bridges
