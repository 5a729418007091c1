#include "luxfield/core/random.h"

namespace luxfield::core {

double Random::Poisson(double mean) {
  if (!(mean > 0)) return 0;
  if (mean < 12) {
    const double limit = std::exp(-mean);
    double product = Uniform(), count = 0;
    while (product > limit) {
      product *= Uniform();
      ++count;
    }
    return count;
  }
  // W. Hoermann, "The transformed rejection method for generating Poisson random variables" (1993),
  // PTRS.
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double v_r = 0.9277 - 3.6224 / (b - 2);
  for (;;) {
    const double u = Uniform() - 0.5, v = Uniform();
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= v_r) return k;
    if (k < 0 || (us < 0.013 && v > us)) continue;
    if (std::log(v) + std::log(inverse_alpha) - std::log(a / (us * us) + b) <=
        -mean + k * std::log(mean) - std::lgamma(k + 1))
      return k;
  }
}

}  // namespace luxfield::core
