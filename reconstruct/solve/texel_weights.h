// How much of a basis function the texels of a measured filter see, along one axis.
//
// A texel t is the mean of T over its width d, of a T that the photographs' pixels have blurred by
// b (standard deviation). With the integrals I_t of B over the texels
//
//   sum_t I_t T_t = integral of T (B + k B'') + ...,   k = d^2 / 12 + b^2 / 2,
//
// as the means and the integrals over texels blur by d^2 / 12 each. The weights
//
//   w_t = I_t - k / d^2 (I_(t-1) - 2 I_t + I_(t+1))
//
// take that back: the error of <Phi*, Phi_m> is of fourth order in d and b, of third where slopes
// of both jump. Derived; second differences, as B has corners.
#pragma once

#include <span>
#include <vector>

#include "luxfield/lightfield/basis.h"

namespace luxfield::reconstruct {

// Of B(x - at), a weight per texel. All in spacings; `edges` of equal distance, rising or falling.
std::vector<double> TexelWeights(const lightfield::Basis& basis, double at,
                                 std::span<const double> edges, double blur);

}  // namespace luxfield::reconstruct
