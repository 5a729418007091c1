// Bounds of mean squares of normal errors, for tests that judge sigma by what really scatters.
#pragma once

#include <cmath>

namespace luxfield {

// Quantile of chi^2 / degrees at z standard deviations of a normal variable, by Wilson and Hilferty
// (1931): good to 1 % of it from 20 degrees on, to 5 % from 10 at |z| <= 4.5. Above 0 from 5
// degrees on, so that a sum of squares that is too small is found too.
inline double ChiSquaredShare(double degrees, double z) {
  const double v = 2 / (9 * degrees);
  return std::pow(1 - v + z * std::sqrt(v), 3);
}

// 1e-5 a side: where some dozens of figures are judged, one run in a thousand fails by chance.
constexpr double kRareZ = 4.265;

}  // namespace luxfield
