// The solve of reconstruct.h run backwards: from weights of the coefficients to weights of the
// irradiances (docs/theory.md 4).
//
//   Q = sum q C,  C = P E   =>   Q = sum w E,  w = P^T q,
//
// P = R_v (x) R_u per texel with the moments that the solve keeps, 1 / h^2 of dual filters, or the
// inverse of the forward model, and the smallest-norm solution's matrix where positions are unknown
// (missing_data.h). Double throughout.
#pragma once

#include "luxfield/lightfield/linear_functional.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/solve/filter_system.h"

namespace luxfield::reconstruct {

// Weights of measurements.positions[m].irradiance, laid out as LightField::data; 0 for unknown
// values. `system`: of filters as measured, one row a position; null: ideal ones. `keep`: as in
// ReconstructOptions.
lightfield::Weights AdjointSolve(const lightfield::Measurements& measurements,
                                 const lightfield::Weights& coefficient_weights,
                                 const FilterSystem* system = nullptr, Keep keep = Keep::kMoments);

}  // namespace luxfield::reconstruct
