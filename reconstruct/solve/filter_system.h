// The forward model with the filters as they are (docs/theory.md 4, second line): measured
// transmittances and the places where the stage really stood.
//
//   E_r(s) = sum_m A_rm C_m(s),   A_rm = <Phi*(. - c_r), Phi_m>   [m^2]
//
// for measurement r behind the filter centred on c_r. A is sparse: a filter of n cells meets
// (2 n - 1)^2 functions, one more per axis where it is displaced. What texels and pixels blur of
// measured transmittances is taken back (texel_weights.h), in double.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::reconstruct {

// A = V (x) U: row j * W + i, column n * W + k is v[j][n] u[i][k].
struct SeparableSystem {
  int width = 0, height = 0;
  std::vector<double> u, v;  // W x W and H x H, row-major
};

// Filters over the interior cells of a grid, where its functions are a partition of unity: means
// over the points' squares of Phi*_r, per row those that are not 0. Point v * width + u, (0, 0) at
// the interior's lower corner.
struct InteriorSamples {
  int width = 0, height = 0;
  std::vector<std::vector<std::pair<int, double>>> filters;
};

class FilterSystem {
 public:
  static constexpr int kMostCoefficients = 4096;

  // Where `filter` is null ideal filters of `kind`: Phi, or the dual function Phi*. At least as
  // many rows as grid.count(), which is at most kMostCoefficients. Throws InputError naming the
  // filter's field that does not fit the grid, the two rows that see through filters in one place
  // where the system is singular for that reason, or its condition number above kLargestCondition
  // (its root where there are more rows: the normal equations square it).
  FilterSystem(const lightfield::BasisGrid& grid, const lightfield::MeasuredFilter* filter,
               std::span<const lightfield::Vec2> centres_m,
               lightfield::FilterKind kind = lightfield::FilterKind::kBasis);
  ~FilterSystem();
  FilterSystem(FilterSystem&&) noexcept;

  int rows() const;
  int columns() const;
  std::size_t entries() const;        // that are not zero
  std::vector<double> Dense() const;  // rows x columns, row-major, m^2

  // Extreme singular values of A by Lanczos iterations with A^T A and its inverse (Golub and Van
  // Loan, Matrix Computations, 10.1), to 1e-9 relative: m^2.
  double smallest_singular_value() const;
  double largest_singular_value() const;
  double condition() const { return largest_singular_value() / smallest_singular_value(); }
  double worst_gain() const { return 1 / smallest_singular_value(); }  // m^-2
  // White noise in E comes out in C this many times larger: |A^+|_F / sqrt(columns), m^-2.
  double noise_gain() const;
  // RMS error of A's entries from the noise of the photographs over the RMS of the entries; 0 for
  // ideal filters. Errors common to all texels are not in it.
  double matrix_noise() const;

  // (A^T A)^-1 A^T, columns x rows, row-major, m^-2.
  const std::vector<double>& PseudoInverse() const;

  lightfield::Vec2 centre(int row) const;  // of the row's filter, m
  // per_cell points along a cell and axis; of basis prints.
  InteriorSamples SampleInterior(int per_cell) const;

  // The nearest separable system in the Frobenius norm, by alternating least squares, if it is
  // within `tolerance` of A, relative; absent too where there are more rows than columns.
  std::optional<SeparableSystem> Separable(double tolerance) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace luxfield::reconstruct
