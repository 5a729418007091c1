// ProjectNonNegative (non_negative.h), row by row: what a row becomes depends on no other row.
#pragma once

#include <cstddef>

#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::reconstruct {

// Pixels are iterated together until the slowest has converged; here only those of one row of `width`
// pixels are.
NonNegativeSummary ProjectNonNegativeRows(const GramSolver& solver, float* const* coefficients,
                                          std::size_t pixels, std::size_t width,
                                          const NonNegativeOptions& options = {});

}  // namespace luxfield::reconstruct
