// From irradiance behind filters to coefficients: the Gram system of docs/theory.md 4, solved
// separably.
//
//   E_ij(s) = sum_mn C_mn(s) <Phi_ij, Phi_mn>
//   E = G_u C G_v^T,   C = G_u^-1 E G_v^-T        per pixel
//
// G_u (W x W) and G_v (H x H) are the 1-D Gram matrices in metres, banded with bandwidth
// n - 1 <= 2, so two banded Cholesky solves take O(W H) per pixel instead of O(W^2 H^2). Where
// moments are kept (kept_moments.h) R takes the place of G^-1, as a correction of E before the same
// sweeps:
//
//   R = G^-1 (1 + A Z^T),   Z = (a - X) S^-1
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/reconstruct/solve/kept_moments.h"

namespace luxfield::reconstruct {

// Of a system as a whole: above it double precision has lost all but 6 digits.
constexpr double kLargestCondition = 1e9;

// One axis: its Gram matrix, factorised in double.
struct GramAxis {
  int count = 0;
  std::vector<double> gram;     // count x count, row-major, m
  std::vector<double> inverse;  // count x count, row-major, 1/m
  // Cholesky G = L L^T: 1 / L[i][i], L[i][i-1], L[i][i-2] (0 where there is no such entry).
  std::vector<double> reciprocal_diagonal, first_band, second_band;
  double smallest_eigenvalue = 0, largest_eigenvalue = 0;  // of G, m
  int moments = 0;                                         // that are kept
  std::vector<double> integrals;                           // A, count x moments, row-major, m
  std::vector<double> correction;                          // Z, count x moments, row-major, 1/m
  std::vector<double> map;  // R, count x count, row-major, 1/m: `inverse` if none are kept

  // Factorises a symmetric count x count matrix of bandwidth <= 2. Throws InputError naming the
  // axis, and the two filters where two sit in one place, if it is not symmetric, wider than its
  // band, not finite or singular (eigenvalue ratio above kLargestCondition).
  static GramAxis Factor(std::vector<double> gram, int count, const std::string& axis);

  // Lets the map keep those moments; they replace any that it kept. InputError if the filters
  // cannot hold them.
  void KeepMoments(const AxisMoments& kept);

  double condition() const { return largest_eigenvalue / smallest_eigenvalue; }
  // RMS over rows of the Euclidean norm of the map's row, 1/m: what white noise is multiplied by.
  double noise_gain() const;
  double worst_gain() const;  // the map's largest singular value, 1/m
};

class GramSolver {
 public:
  explicit GramSolver(const lightfield::BasisGrid& grid, KeptMoments kept = {});
  // Throws InputError with the condition numbers where their product is above kLargestCondition.
  GramSolver(GramAxis u, GramAxis v);

  const GramAxis& u() const { return u_; }
  const GramAxis& v() const { return v_; }
  int count() const { return u_.count * v_.count; }

  double condition() const { return u_.condition() * v_.condition(); }
  // White noise in E comes out in C this many times larger, m^-2; times h^2 it is the plain figure
  // of docs/theory.md 4 (10.7 for bspline2 on 11 x 9).
  double noise_gain() const { return u_.noise_gain() * v_.noise_gain(); }
  // The same for the worst (alternating) systematic error.
  double worst_gain() const { return u_.worst_gain() * v_.worst_gain(); }

  // Solves for `pixels` pixels (all channels alike): irradiance[m][p] -> coefficients[m][p],
  // m = j * W + i. coefficients[m] may be irradiance[m]. Arithmetic and factors are in Work;
  // <float, float> has a relative error of a few condition() * 6e-8. Instantiated for <float,
  // float>, <float, double>, <double, double>. Parallel over pixels; the result does not depend on
  // the number of threads.
  template <typename Storage, typename Work>
  void Solve(const Storage* const* irradiance, Storage* const* coefficients,
             std::size_t pixels) const;

  // weights[m][p] = sum over n of (R_v (x) R_u)_nm coefficient_weights[n][p], in double: what the
  // weights of coefficients are as weights of irradiances.
  void SolveTransposed(const double* const* coefficient_weights, double* const* weights,
                       std::size_t pixels) const;

  // The forward model E = G_u C G_v^T of one pixel, in double; both have count() entries.
  void Forward(const double* coefficients, double* irradiance) const;

 private:
  GramAxis u_, v_;
};

}  // namespace luxfield::reconstruct
