// What the noise of a filter's photographs does to a quantity Q = sum w E (print_sensitivity.h):
//
//   dQ = h^2 sum over texels t of factor dT_t integral_t S(x) dx
#pragma once

#include "lightfield/measured_filter.h"
#include "reconstruct/print_sensitivity.h"

namespace luxfield::reconstruct {

// Variance of Q. Texels count as independent, but for the pixels they share: sum_sigma_ratio^2.
double FilterNoiseVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags);

}  // namespace luxfield::reconstruct
