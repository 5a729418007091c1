// What positions that texels did not see leave open of a quantity Q = sum q C.
//
// Behind such positions C is the smallest that fits the others, C = P A C_lamp (missing_data.h), so
// that without noise
//
//   Q(C_lamp) - Q(C) = sum r C_lamp,     r = q - A^T w,   w = P^T q,
//
// exactly, for P A is symmetric. Nobody measured that part of C_lamp. It is taken to be like the
// coefficients of the texel nearby, independent, with a mean mu_m and a variance s_m^2 that weights
// v_k = exp(-d^2 / 2) at d spacings find in C_k: those of C = P A C_lamp are mu h and s^2 diag(P
// A), h = P A 1, so that
//
//   mu_m = sum v h C / sum v h^2,     s_m^2 = sum v (C - mu_m h)^2 / [(1 - 1 / n) sum v diag(P A)],
//
// n_m = (sum v)^2 / sum v^2. Lamps are alike from texel to texel, so what is unknown of one filter
// is one error for all of I, and so is that of the means:
//
//   sigma^2 = (sum r_m mu_m)^2 + sum_m (sum over texels of r_m s_m)^2
//             + (sum r_m s_m / sqrt(n_m))^2
//
// A lamp that ends where the positions are missing leaves less open, one that begins there more:
// sigma(C) beside C does not ask its neighbours (pixel_weights.h). A texel that knows nothing is
// taken to be as the mean of the others. Double.
#pragma once

#include <span>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/solve/filter_system.h"

namespace luxfield::reconstruct {

// Of every quantity: `coefficient_weights` q and `irradiance_weights` w as AdjointSolve has them,
// `field` as solved from the measurements, `system` as there. 0 where nothing is missing.
std::vector<double> MissingSigmas(const lightfield::Measurements& measurements,
                                  const lightfield::LightField& field,
                                  std::span<const lightfield::Weights* const> coefficient_weights,
                                  std::span<const lightfield::Weights* const> irradiance_weights,
                                  const FilterSystem* system = nullptr);

}  // namespace luxfield::reconstruct
