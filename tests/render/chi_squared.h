// Pearson's test of draws against the shares that bins should get.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

namespace luxfield::render {

// chi^2 of the counts `observed` against `expected`, which may be of any scale, in standard
// deviations above its mean; printed. Bins that fewer than 10 draws are expected in count as one.
inline double ChiSquaredDeviations(const std::vector<double>& expected,
                                   const std::vector<double>& observed, const std::string& what) {
  const double count = std::accumulate(observed.begin(), observed.end(), 0.0),
               total = std::accumulate(expected.begin(), expected.end(), 0.0);
  double chi = 0, pooled_expected = 0, pooled_observed = 0;
  int bins = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const double e = expected[k] / total * count;
    if (e < 10) {
      pooled_expected += e;
      pooled_observed += observed[k];
      continue;
    }
    chi += (observed[k] - e) * (observed[k] - e) / e;
    ++bins;
  }
  if (pooled_expected > 0) {
    chi += std::pow(pooled_observed - pooled_expected, 2) / std::max(pooled_expected, 1.0);
    ++bins;
  }
  const double deviations = (chi - (bins - 1)) / std::sqrt(2.0 * std::max(bins - 1, 1));
  std::printf("%s: chi^2 %.1f of %d bins, %.2f standard deviations\n", what.c_str(), chi, bins,
              deviations);
  return deviations;
}

}  // namespace luxfield::render
