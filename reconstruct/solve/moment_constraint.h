// Moments over F that a general forward model E = M C keeps (docs/theory.md 4, "Flux and moments").
//
//   C = C_0 + Y (m - A^T C_0),   m = a^T E,   Y = X (A^T X)^-1,   X = G^-1 A
//
// with A the integrals of 1, u and v times the functions and G their Gram matrix: the C nearest to
// C_0 over F whose moments are m. Filters that are measured, displaced or repeated are no partition
// of unity; a makes of them the best there is,
//
//   a = argmin over the interior cells of integral (sum a_r Phi*_r - 1)^2 du,  and u and v for 1
//
// close to the weights that ideal filters have, which decides where filters leave a open.
#pragma once

#include <span>
#include <vector>

#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/kept_moments.h"

namespace luxfield::reconstruct {

struct MomentConstraint {
  int moments = 0;                // kept: 0, 1 (flux) or 3 (first moments too)
  int rows = 0, columns = 0;      // of M
  std::vector<double> integrals;  // A, columns x moments, row-major, u and v in spacings
  std::vector<double> step;       // Y, columns x moments
  std::vector<double> measured;   // a, rows x moments
  // Root mean square over the interior cells of sum a_r Phi*_r - 1: how far the flux of a point of
  // light may be off; and of the same with the weights by which least squares alone have it.
  double residual = 0, residual_of_least_squares = 0;

  // The map C = R E with those moments where C_0 = P E: (1 - Y A^T) P + Y a^T. P and the result are
  // columns x rows, row-major.
  std::vector<double> Map(const std::vector<double>& p) const;
};

// `kept`: what both axes allow; the constraint is one of both together and needs both. A moment
// whose residual is not below that of least squares is not kept: it would not be known better.
// `row_noise`: a standard deviation for each row, which repeats of one position (rows r and
// r + grid.count()) share a by; empty: alike.
MomentConstraint ConstrainMoments(const FilterSystem& system, const lightfield::BasisGrid& grid,
                                  KeptMoments kept, std::span<const double> row_noise = {});

}  // namespace luxfield::reconstruct
