// What the noise of a filter's photographs does to a quantity Q = sum w E (print_sensitivity.h):
//
//   dQ = h^2 sum over texels t of factor dT_t w_t, w the weights of S (texel_weights.h),
//   dQ = Stretch . L, where the holder's holes put the texels at x + L x from the axis, and
//   dQ = sum over prints of dQ_print (dl_print - dl), relative errors of the light in the holes
#pragma once

#include "luxfield/lightfield/measured_filter.h"
#include "luxfield/reconstruct/budget/print_sensitivity.h"

namespace luxfield::reconstruct {

// Variances of Q. Texels count as independent, but for the pixels they share: sum_sigma_ratio^2.
double TexelNoiseVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags);
double StretchVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags);
// Half of level_sigma^2 is the photograph's of the light alone, by which all prints are divided;
// the other half each print's own.
double LevelVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags);

}  // namespace luxfield::reconstruct
