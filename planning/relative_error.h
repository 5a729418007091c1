// The relative RMSE of docs/theory.md 10 over a random sample of places, with its standard error.
#pragma once

#include <span>

namespace luxfield::planning {

// R = RMS of value - truth over the mean of truth. The standard error is that of a ratio estimator
// (Cochran 1977, 6.4): what another sample of places would change.
struct RelativeError {
  double value = 0, standard_error = 0;
};
RelativeError RelativeRmse(std::span<const double> values, std::span<const double> truth);

}  // namespace luxfield::planning
