// Smoother coefficients than the data ask for, and what that costs (docs/theory.md 4).
//
//   C = argmin |E / h^2 - A C|^2 + lambda^2 |D C|^2        per texel
//
// A = <Phi*_r, Phi_m> / h^2, D the differences between coefficients of neighbouring filters along u
// and v: what a smooth lamp does not have, and what noise has most of (docs/theory.md 4: the worst
// mode alternates). A lamp that is even over the filters is not touched. Modes whose singular value
// lies far below lambda |D| are damped.
//
// C is linear in E, C = P E, and its expectation R C with R = P A: the bias is (R - 1) C. The
// solution without regularisation has none, so that over many texels
//
//   mean |(P - A^-1) E|^2 - mean |(P - A^-1) noise|^2
//
// is an unbiased estimate of the bias squared, and with |P noise|^2 of the error (Stein 1981); the
// lambda of least error is where that is smallest. By the generalised singular vectors A T = W,
// D T orthogonal, W orthonormal, P = T diag(1 / (1 + lambda^2 gamma)) W^T.
//
// Moments that the plain solution keeps (moment_constraint.h) are given to the smooth one as well,
// P' = (1 - Y A^T) P + Y a^T; its bias against the plain one that keeps them is (1 - Y A^T)(R - 1)
// C.
#pragma once

#include <optional>
#include <span>

#include "luxfield/lightfield/basis.h"
#include "luxfield/reconstruct/solve/moment_constraint.h"
#include "luxfield/reconstruct/solve/pixel_weights.h"

namespace luxfield::reconstruct {

struct RegularisationSummary {
  double lambda = 0;
  bool chosen = false;  // the one of least estimated error, to a tenth of a decade
  // Root mean squares over the texels that were regularised, over that of C: as estimated, noise
  // subtracted; 0 where noise hides it.
  double noise_before = 0, noise = 0, bias = 0;
  double flux_bias = 0;  // of the sum of C, relative
  // |R - 1|: no C whatever is biased by more than this share of its norm, per texel.
  double worst_bias = 0;
  double noise_gain = 0;   // of white noise, in units of 1 / h^2
  std::size_t texels = 0;  // those with all positions known
};

// Replaces C and sigma(C) of the texels with all positions known; the others keep theirs. sigma is
// that of noise alone. One lambda for all texels and channels; sigma of E does not weigh.
// Arithmetic in double: about 30 columns^3 multiplications and 4 columns^2 a texel and channel.
// Throws InputError for more than 2e12 of them, a lambda that is not above 0, a system that is not
// square, a single filter, no complete texel, and light that does not show above its noise.
//   unknown[r][p] != 0   measurement r of texel p is unknown
RegularisationSummary Regularise(const FilterSystem& system, const lightfield::BasisGrid& grid,
                                 std::optional<double> lambda,
                                 std::span<const std::uint32_t* const> unknown,
                                 const PixelImages& images, const MomentConstraint& kept = {});

}  // namespace luxfield::reconstruct
