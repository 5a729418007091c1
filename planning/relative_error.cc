#include "luxfield/planning/relative_error.h"

#include <cmath>

namespace luxfield::planning {

RelativeError RelativeRmse(std::span<const double> values, std::span<const double> truth) {
  const auto n = static_cast<double>(truth.size());
  double mean = 0, square = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    mean += truth[k] / n;
    square += (values[k] - truth[k]) * (values[k] - truth[k]) / n;
  }
  RelativeError error;
  const double r2 = square / (mean * mean);
  error.value = std::sqrt(r2);
  // d R^2 of one place: (value - truth)^2 / mean^2 - 2 R^2 truth / mean, about its mean -R^2.
  double scatter = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double off = values[k] - truth[k];
    const double z = off * off / (mean * mean) - 2 * r2 * truth[k] / mean + r2;
    scatter += z * z;
  }
  if (r2 > 0 && n > 1)
    error.standard_error = std::sqrt(scatter / (n * (n - 1))) / (2 * error.value);
  return error;
}

}  // namespace luxfield::planning
