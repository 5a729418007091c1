// Pixels that some filter positions never saw (THEORY.md 3, "Registration"): unknown is not zero.
//
// Where only a subset K of the W H irradiances is known, the equations A C = E_K (A = the rows K of
// the Gram matrix G_v (x) G_u) leave C undetermined. The prior is the smallest |C|: C = A^T (A
// A^T)^-1 E_K. Where K is a product I x J (a rectangular sensor), A's pseudo-inverse is the product
// of two small ones. Elsewhere let D = (I x J) \ K be the gaps, P the pseudo-inverse for I x J, Q =
// (A A^T)^-1 there: choosing the values in the gaps that make |C| smallest gives the weights
//
//   C = (P - P_D (Q_DD)^-1 Q_D) E_IxJ        (columns D of the bracket are zero, so gaps never
//   enter)
//
// which for a few gaps (defects) costs hardly more than the product.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "reconstruct/gram_solve.h"

namespace luxfield::reconstruct {

// Known irradiances of one kind of pixel, and how to solve it.
class MinimumNormWeights {
 public:
  // known[m], m = j * W + i. All false: every weight is zero.
  MinimumNormWeights(const GramSolver& solver, const std::vector<bool>& known);

  const std::vector<int>& rows_u() const { return rows_u_; }  // I, ascending
  const std::vector<int>& rows_v() const { return rows_v_; }  // J, ascending
  bool is_product() const { return gaps_.empty(); }
  const std::vector<int>& gaps() const { return gaps_; }  // D as indices j' * |I| + i' into I x J

  // Pseudo-inverses of the rows I of G_u (W x |I|) and J of G_v (H x |J|), row-major.
  const std::vector<double>& inverse_u() const { return inverse_u_; }
  const std::vector<double>& inverse_v() const { return inverse_v_; }

  // All weights, W H x |I||J| row-major: C[m] = sum_k weights[m][k] E_IxJ[k].
  std::vector<double> Dense() const;

 private:
  int width_, height_;
  std::vector<int> rows_u_, rows_v_, gaps_;
  std::vector<double> inverse_u_, inverse_v_;
  std::vector<double> normal_u_, normal_v_;  // (A A^T)^-1 per axis
};

struct IncompletePixels {
  std::size_t incomplete = 0;  // at least one filter position unknown: solved by the smallest |C|
  std::size_t with_gaps = 0;   // of these, known sets that are no product I x J
  std::size_t unknown = 0;     // of these, nothing known at all: C = 0 and sigma = 0 say nothing
};

// Solves the pixels with unknown positions and propagates their variance; leaves the others alone.
//   unknown[m][p] != 0   irradiance m of pixel p is unknown; `pixels` entries
//   irradiance[m][c * pixels + p], sigma[m][...]   per channel c
//   coefficients[m][...], coefficient_sigma[m][...]   written for incomplete pixels
// Arithmetic in double. Throws InputError naming the count if known sets with gaps need more than
// about 2e11 multiplications.
IncompletePixels SolveIncomplete(const GramSolver& solver, const std::uint32_t* const* unknown,
                                 std::size_t pixels, int channels, const float* const* irradiance,
                                 const float* const* sigma, float* const* coefficients,
                                 float* const* coefficient_sigma);

}  // namespace luxfield::reconstruct
