// Texels of I seen on F through a point, or along a direction, axis by axis: the closed-form
// weights behind irradiance, intensity and the light-vector volume (docs/theory.md 2 and 7).
#pragma once

#include <span>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::lightfield {

// One axis of the lattice: texel k lies between origin + k step and origin + (k + 1) step. Rows
// have a negative step.
struct TexelAxis {
  int count = 0;
  double origin_m = 0;
  double step_m = 0;

  static TexelAxis Columns(const Lattice& lattice) {
    return {lattice.width, lattice.s0_m, lattice.ds_m};
  }
  static TexelAxis Rows(const Lattice& lattice) {
    return {lattice.height, lattice.t1_m, -lattice.dt_m};
  }
};

// One axis of the map from I to F along a pencil of lines: u = u_pivot + w, s = s_pivot + w
// s_per_w. w is counted from a pivot on the pencil so that neither a window nor a texel far smaller
// than its coordinates loses digits.
struct PencilAxis {
  double s_pivot_m = 0;
  double u_pivot_m = 0;
  double s_per_w = 1;
  double moment_offset_m = 0;  // the first moment is that of u - p = w + moment_offset

  // Lines through a receiver with this coordinate at height z > 0:
  // s = (u (z - delta) + p delta) / z.
  static PencilAxis ThroughPoint(double p_m, double z_m, double delta_m);
  // Parallel lines s = u + shift.
  static PencilAxis Parallel(double shift_m) { return {shift_m, 0, 1, 0}; }
};

// For the run of texels first .. first + size() - 1 that the support of one basis function meets:
//   zeroth = integral of B((u - u0)/h - i) du over the texel's image on F
//   moment = integral of B((u - u0)/h - i) (u - p) du over it
struct ProjectedTexels {
  int first = 0;
  std::vector<double> zeroth;      // m
  std::vector<double> moment;      // m^2
  std::vector<double> w_lo, w_hi;  // each texel's image on F within the support, w_lo <= w_hi

  std::size_t size() const { return zeroth.size(); }
};

ProjectedTexels ProjectTexels(const Basis& basis, double u0_m, double spacing_m, int i,
                              const TexelAxis& texels, const PencilAxis& pencil);

// ProjectTexels for i = 0 .. count - 1.
std::vector<ProjectedTexels> ProjectAllTexels(const Basis& basis, double u0_m, double spacing_m,
                                              int count, const TexelAxis& texels,
                                              const PencilAxis& pencil);

// Sums of values[k] * a[k] and values[k] * b[k].
struct TwoSums {
  double a = 0, b = 0;
};
TwoSums WeightedSums(std::span<const float> values, std::span<const double> a,
                     std::span<const double> b);

}  // namespace luxfield::lightfield
