#include "luxfield/photometry/beyond_planes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::photometry {
namespace {

using lightfield::LightField;
using lightfield::LuminaireGeometry;
using lightfield::Vec2;

// pi times the configuration factor of a rectangle x by y with a corner before the place; odd in both.
double Corner(double x, double y, double delta) {
  const double a = x / delta, b = y / delta;
  const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return 0.5 * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb));
}

double BrightestOnBorder(const LightField& field, Vec2 u) {
  const auto& lattice = field.geometry.lattice;
  double brightest = 0;
  const auto look = [&](int row, int column) {
    brightest = std::max(brightest, lightfield::Radiance(field, u, lattice.centre(row, column))[0]);
  };
  for (int column = 0; column < lattice.width; ++column) {
    look(0, column);
    look(lattice.height - 1, column);
  }
  for (int row = 0; row < lattice.height; ++row) {
    look(row, 0);
    look(row, lattice.width - 1);
  }
  return brightest;
}

double BoundOf(const LightField& field) {
  const LuminaireGeometry& g = field.geometry;
  const double h = g.grid.spacing_m;
  const double s0 = g.lattice.s0_m, s1 = s0 + g.lattice.extent_s_m(), t1 = g.lattice.t1_m,
               t0 = t1 - g.lattice.extent_t_m();
  double bound = 0;
  const int extra = g.grid.basis.cells - 1;
  for (int j = 0; j < g.grid.height + extra; ++j)
    for (int i = 0; i < g.grid.width + extra; ++i) {
      const Vec2 u{g.grid.u0_m + (i + 0.5) * h, g.grid.v0_m + (j + 0.5) * h};
      const double beyond =
          std::numbers::pi - ProjectedSolidAngle(s0 - u.x, s1 - u.x, t0 - u.y, t1 - u.y, g.delta_m);
      bound += h * h * BrightestOnBorder(field, u) * beyond;
    }
  return bound;
}

}  // namespace

double ProjectedSolidAngle(double s0, double s1, double t0, double t1, double delta_m) {
  return Corner(s1, t1, delta_m) - Corner(s0, t1, delta_m) - Corner(s1, t0, delta_m) +
         Corner(s0, t0, delta_m);
}

double FluxBeyondPlanesBound(const Lamp& lamp) {
  double bound = 0;
  for (const auto& posed : lamp.fields) bound += BoundOf(posed.field);
  return bound;
}

}  // namespace luxfield::photometry
