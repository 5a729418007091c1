// Non-negative coefficients: the luminaire with C >= 0 nearest to a solution of the Gram system.
//
// Nearest in the L2 norm over F of the differential irradiance, per pixel,
//
//   |sum (C - C_0) Phi|^2 = (C - C_0)^T G (C - C_0),
//
// by default among those with the flux of C_0, sum C = sum C_0. Without that condition it is, for
// complete data, the non-negative least squares of docs/theory.md 4, whose flux is never below the
// measured one: light that is a point on F gains up to 86 % (bspline2). Accelerated projected
// gradient (Nesterov 2004, 2.2.81, with the constant momentum of a strongly convex quadratic); it
// stops by the Karush-Kuhn-Tucker residual.
//
// First moments over F may be kept as well, after that: C (1 + a + b i + c j) with the three
// numbers that give C_0's sums of C, i C and j C, the smallest change in the norm |dC|^2 / C. Where
// a factor would be below 0, C keeps the flux alone.
#pragma once

#include <cstddef>
#include <string>

#include "luxfield/reconstruct/solve/gram_solve.h"

namespace luxfield::reconstruct {

enum class NonNegativeMetric { kCoefficients, kIrradiance };
NonNegativeMetric NonNegativeMetricFromName(const std::string& name);  // InputError on others
std::string NonNegativeMetricName(NonNegativeMetric metric);           // "coefficients", ...

struct NonNegativeOptions {
  bool keep_flux = true;            // sum C = sum C_0; a pixel whose sum is not above 0 becomes 0
  bool keep_first_moments = false;  // with keep_flux
  // Stop where max_m |C - P(C - g / d)|_m <= tolerance * max_m |C_0,m|, with g = G (C - C_0) the
  // gradient, d the largest diagonal entry of G and P the projection on the feasible set (without
  // keep_flux that is |min(C, g / d)|). Float data cannot hold less than about 1e-6.
  double tolerance = 1e-5;
  int max_iterations = 2000;
  // Pixels are iterated together until the slowest has converged; only those of one run of so many
  // are, so that what a row becomes depends on no other row. 0: all are one run.
  std::size_t row = 0;
};

struct NonNegativeSummary {
  NonNegativeMetric metric = NonNegativeMetric::kCoefficients;
  std::size_t pixels = 0;        // that had a negative coefficient (a channel counts for itself)
  std::size_t unconverged = 0;   // left above the tolerance after max_iterations
  std::size_t moments_lost = 0;  // whose first moments no C >= 0 near the solution has
  int iterations = 0;            // of the slowest block
  double worst_residual = 0;     // of the stopping rule, relative
};

// Replaces coefficients[m][p] (m = j * W + i, p < pixels) in place. Pixels without a negative
// coefficient, and those with one that is no finite number, stay as they are, to the bit.
// Arithmetic in the type of the data, in units of the pixel's largest |C_0|, which holds the
// residual of floats above some 1e-6; the flux is mended in double. Vectorised and parallel over
// pixels: 21 operations a coefficient and iteration.
NonNegativeSummary ProjectNonNegative(const GramSolver& solver, float* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options = {});
NonNegativeSummary ProjectNonNegative(const GramSolver& solver, double* const* coefficients,
                                      std::size_t pixels, const NonNegativeOptions& options = {});

}  // namespace luxfield::reconstruct
