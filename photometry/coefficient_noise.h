// How uncertain coefficients are together, from what a file says of each (docs/theory.md 4).
//
// A solve makes the coefficients of a texel from irradiances whose noise is independent from filter
// to filter,
//
//   C = (R_v (x) R_u) E,     sigma(C)^2 = ((R_v o R_v) (x) (R_u o R_u)) sigma(E)^2
//
// (o: elementwise). Neighbouring coefficients lean against each other: taken as independent, the
// flux of `bspline2` would seem ten times as uncertain as it is. A file holds sigma(C); the second
// line solved for sigma(E), per texel, gives what any linear form is uncertain by:
//
//   var(sum q C) = sum over texels, i, j of (R_u^T q R_v)_ij^2 sigma(E)_ij^2
//
// Texels and fields are independent of each other. It is noise alone: what all coefficients share
// (exposure times, drift, geometry, filters, calibration) is in no sigma(C) (docs/theory.md 13).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::photometry {

// R_u (W x W) and R_v (H x H), row-major, in any unit; both empty: coefficients are independent, as
// those behind dual filters are.
struct SolveMaps {
  std::vector<double> u, v;
  bool independent() const { return u.empty(); }
};

// A rectangle of texels.
struct TexelWindow {
  int row0 = 0, rows = 0, column0 = 0, columns = 0;
  std::size_t size() const { return static_cast<std::size_t>(rows) * columns; }
};

// Weights that are products along both axes: x[i * columns + column] y[j * rows + row] of coefficient
// ij over a window.
struct SeparableWeights {
  std::vector<double> x, y;
};

class CoefficientNoise {
 public:
  // `sigma`: standard deviations, laid out as a light field of one channel. Throws InputError if a
  // value is negative, std::invalid_argument if the maps' sizes are not those of the grid.
  CoefficientNoise(const lightfield::LightField& sigma, SolveMaps maps);

  // Of sum q C; weights[(m * rows + row) * columns + column] over the window, 0 beyond.
  double Variance(const TexelWindow& window, std::span<const double> weights) const;

  // The same of a sum of separable weights, without their products in memory: what R makes of them is
  // separable again.
  double Variance(const TexelWindow& window, std::span<const SeparableWeights> terms) const;

  // The weights of independent draws of variance 1 that make the noise of sum q C, laid out as
  // `weights`: its variance is the sum of their squares, its covariance with another the sum of their
  // products over the texels that both windows hold.
  std::vector<double> Whitened(const TexelWindow& window, std::span<const double> weights) const;

  // Texels whose sigma no solve of all positions leaves (unknown positions, for one, widen it by a
  // prior): their coefficients are taken as independent.
  std::size_t independent_texels() const { return independent_texels_; }

 private:
  // Of one row of the window, [m][column].
  std::vector<double> WhitenedRow(const TexelWindow& window, std::span<const double> weights,
                                  int row) const;
  void FindIrradianceSigma();

  lightfield::LuminaireGeometry geometry_;
  SolveMaps maps_;
  // Per coefficient: sigma(E), or sigma(C) in independent texels.
  std::vector<float> sigma_;
  std::vector<char> independent_;  // per texel
  std::size_t independent_texels_ = 0;
};

}  // namespace luxfield::photometry
