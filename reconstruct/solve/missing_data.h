// Pixels that some filter positions never saw (docs/theory.md 3, "Registration"): unknown is not
// zero.
//
// Where only a subset K of the W H irradiances is known, the equations A C = E_K (A = the rows K of
// the separable system V (x) U) leave C undetermined. The prior is that of pixel_weights.h: the
// smallest |C|, C = A^T (A A^T)^-1 E_K, and a variance that says how little is known. Where K is a
// product I x J (a rectangular sensor), A's pseudo-inverse is the product of two small ones.
// Elsewhere let D = (I x J) \ K be the gaps, P the pseudo-inverse for I x J, Q = (A A^T)^-1 there:
// choosing the values in the gaps that make |C| smallest gives the weights
//
//   C = (P - P_D (Q_DD)^-1 Q_D) E_IxJ
//
// whose bracket has columns D of zeros, so that gaps never enter. For a few gaps (defects) it costs
// hardly more than the product.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/gram_solve.h"
#include "luxfield/reconstruct/solve/pixel_weights.h"

namespace luxfield::reconstruct {

// Ideal filters at their planned places.
SeparableSystem GramSystem(const GramSolver& solver);

// Known irradiances of one kind of pixel, and how to solve it.
class MinimumNormWeights {
 public:
  // known[m], m = j * W + i. All false: every weight is zero.
  MinimumNormWeights(const SeparableSystem& system, const std::vector<bool>& known);

  const std::vector<int>& rows_u() const { return rows_u_; }  // I, ascending
  const std::vector<int>& rows_v() const { return rows_v_; }  // J, ascending
  bool is_product() const { return gaps_.empty(); }
  const std::vector<int>& gaps() const { return gaps_; }  // D as indices j' * |I| + i' into I x J

  // Pseudo-inverses of the rows I of U (W x |I|) and J of V (H x |J|), row-major.
  const std::vector<double>& inverse_u() const { return inverse_u_; }
  const std::vector<double>& inverse_v() const { return inverse_v_; }

  // 1 - (P A)_mm of a product set.
  std::vector<double> PriorShare() const;

  // Of any set: the weights of its known irradiances, gaps left out.
  PixelWeights Dense() const;

 private:
  SeparableSystem system_;
  int width_, height_;
  std::vector<int> rows_u_, rows_v_, gaps_;
  std::vector<double> inverse_u_, inverse_v_;
  std::vector<double> normal_u_, normal_v_;  // (A A^T)^-1 per axis
};

struct IncompletePixels {
  std::size_t incomplete = 0;  // at least one filter position unknown: solved by the smallest |C|
  std::size_t with_gaps = 0;   // of these, known sets that are no product I x J
  std::size_t unknown = 0;     // of these, nothing known at all: C = 0, sigma from other pixels
};

// Solves the pixels with unknown positions, and the others too if asked for, else they have been
// solved before: pixels of which nothing is known get the standard deviation that C has about 0
// over the known pixels of a channel.
//   unknown[m][p] != 0   irradiance m of pixel p is unknown; images.pixels entries
// Arithmetic in double. Throws InputError naming the count if known sets with gaps need more than
// about 2e11 multiplications.
IncompletePixels SolveIncomplete(const SeparableSystem& system,
                                 std::span<const std::uint32_t* const> unknown,
                                 const PixelImages& images, bool with_complete = false);

}  // namespace luxfield::reconstruct
