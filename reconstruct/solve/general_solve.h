// Coefficients from a system that is not separable, or that has more measurements than
// coefficients.
#pragma once

#include <cstdint>
#include <span>

#include "luxfield/reconstruct/solve/filter_system.h"
#include "luxfield/reconstruct/solve/missing_data.h"
#include "luxfield/reconstruct/solve/moment_constraint.h"
#include "luxfield/reconstruct/solve/pixel_weights.h"

namespace luxfield::reconstruct {

// Solves all pixels, set by set of known measurements:
//  - as many as coefficients, and all known: C = A^-1 E;
//  - more, and those known determine C: C = (A^T w A)^-1 A^T w E, sigma(C)^2 = diag (A^T w A)^-1
//    with w = 1 / sigma^2 per pixel (Gauss-Markov);
//  - known ones that leave C undetermined: the prior of pixel_weights.h.
// Complete pixels have the moments of `kept`, and sigma(C) of that map.
//   unknown[r][p] != 0   measurement r of pixel p is unknown
// Arithmetic in double. About columns^2 multiplications a value, columns^3 / 3 with weights. Throws
// InputError naming the count above 2e12 of them, and a sigma that is not above 0 where it weights.
IncompletePixels SolveGeneral(const FilterSystem& system,
                              std::span<const std::uint32_t* const> unknown,
                              const PixelImages& images, const MomentConstraint& kept = {});

// The complete pixels alone, of a square system, with those moments.
void SolveKeeping(const FilterSystem& system, const MomentConstraint& kept,
                  std::span<const std::uint32_t* const> unknown, const PixelImages& images);

}  // namespace luxfield::reconstruct
