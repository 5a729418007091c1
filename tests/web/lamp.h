// A small lamp for the tests of web/: off the axis, no two lengths alike, and smooth against its
// texels and knots.
#pragma once

#include <cmath>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::web {

inline lightfield::LightField SmallLamp(int channels = 1) {
  lightfield::LuminaireGeometry g;
  g.delta_m = 0.3;
  g.grid = lightfield::BasisGrid::Centred(lightfield::Basis::Make(lightfield::BasisKind::kBspline2),
                                          4, 3, 0.03);
  g.grid.u0_m += 0.011;
  g.grid.v0_m -= 0.007;
  g.lattice = {60, 54, -0.14, 0.13, 0.0047, 0.0045};
  g.channels = channels;
  g.unit = lightfield::FluxUnit::kLumen;
  lightfield::LightField field(g);
  for (int m = 0; m < g.grid.count(); ++m)
    for (int channel = 0; channel < channels; ++channel)
      for (int r = 0; r < g.lattice.height; ++r)
        for (int c = 0; c < g.lattice.width; ++c) {
          const auto s = g.lattice.centre(r, c);
          const double x = (s.x - 0.005 * m) / 0.04, y = (s.y + 0.004 * m) / 0.035;
          field.image(m, channel)[r * g.lattice.width + c] = static_cast<float>(
              1e6 * (1 + 0.3 * channel) * std::exp(-0.5 * (x * x + y * y)) * (1 + 0.1 * m));
        }
  return field;
}

}  // namespace luxfield::web
