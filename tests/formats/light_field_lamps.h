// Light fields for tests of what is exported of them.
#pragma once

#include <cmath>
#include <vector>

#include "luxfield/lightfield/posed_light_field.h"

namespace luxfield::formats {

// A smooth beam without any symmetry towards +u, -v, brighter on the side +u, +v of F: about 1000
// lm. Its brightest direction is about C = 22 degrees.
inline lightfield::LightField AsymmetricField(
    int channels = 1, lightfield::BasisKind basis = lightfield::BasisKind::kBspline2,
    int finer = 1) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.2;
  g.unit = lightfield::FluxUnit::kLumen;
  g.channels = channels;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(basis), 4, 3, 0.01);
  g.lattice = {40 * finer, 32 * finer, -0.1, 0.08, 0.005 / finer, 0.005 / finer};
  lightfield::LightField field(g);
  for (int j = 0; j < g.grid.height; ++j)
    for (int i = 0; i < g.grid.width; ++i)
      for (int channel = 0; channel < channels; ++channel) {
        const auto image = field.image(g.grid.index(i, j), channel);
        for (int row = 0; row < g.lattice.height; ++row)
          for (int column = 0; column < g.lattice.width; ++column) {
            const auto s = g.lattice.centre(row, column);
            const double x = (s.x - 0.05) / 0.03, y = (s.y + 0.02) / (0.02 + 0.01 * channel);
            image[std::size_t(row * g.lattice.width + column)] = static_cast<float>(
                1e8 * (1 + 0.3 * i + 0.2 * j) * std::exp(-0.5 * (x * x + y * y)));
          }
      }
  return field;
}

// At the luminaire's own frame.
inline std::vector<lightfield::PosedLightField> AsymmetricLamp(int channels = 1) {
  return {{"", {}, AsymmetricField(channels)}};
}

// The same beam, and another one of a third of its light towards +u from beside it.
inline std::vector<lightfield::PosedLightField> LampOfTwoSides() {
  lightfield::LightField side = AsymmetricField();
  for (float& c : side.data) c /= 3;
  // The field's x, y, z point to -z, y, +x.
  return {{"+z", {}, AsymmetricField()},
          {"+x", {{0, 0, 1, 0, 1, 0, -1, 0, 0}, {0.03, 0.01, -0.02}}, side}};
}

}  // namespace luxfield::formats
