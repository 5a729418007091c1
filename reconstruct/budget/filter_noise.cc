#include "luxfield/reconstruct/budget/filter_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/reconstruct/solve/texel_weights.h"

namespace luxfield::reconstruct {
namespace {

// What each texel sees of B(x - a), a = 1 - n ... n - 1; x in spacings from the print's lower
// corner.
std::vector<std::vector<double>> WeightsOfLags(const lightfield::MeasuredFilter& filter,
                                               const std::vector<double>& edges) {
  std::vector<std::vector<double>> result;
  for (int a = 1 - filter.basis.cells; a < filter.basis.cells; ++a)
    result.push_back(TexelWeights(filter.basis, a, edges, filter.blur_m / filter.spacing_m));
  return result;
}

PrintSensitivity Print(const lightfield::MeasuredFilter& filter) {
  return {filter.filter, filter.basis, filter.spacing_m, filter.filter_scale};
}

}  // namespace

double TexelNoiseVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags) {
  const auto& lattice = filter.lattice;
  const double h = filter.spacing_m, half = 0.5 * filter.basis.cells;
  std::vector<double> columns, rows;
  for (int c = 0; c <= lattice.width; ++c) columns.push_back(lattice.s_of_column(c) / h + half);
  for (int r = 0; r <= lattice.height; ++r) rows.push_back(lattice.t_of_row(r) / h + half);
  const auto u = WeightsOfLags(filter, columns), v = WeightsOfLags(filter, rows);
  const int n = filter.basis.cells;
  const std::vector<double> factors = filter.factors();
  double variance = 0;
  std::vector<double> along_v(u.size());
  for (int r = 0; r < lattice.height; ++r) {
    for (std::size_t a = 0; a < u.size(); ++a) {
      along_v[a] = 0;
      for (std::size_t b = 0; b < v.size(); ++b)
        along_v[a] += lags.at(static_cast<int>(a) + 1 - n, static_cast<int>(b) + 1 - n) *
                      v[b][static_cast<std::size_t>(r)];
    }
    for (int c = 0; c < lattice.width; ++c) {
      double s = 0;
      for (std::size_t a = 0; a < u.size(); ++a)
        s += along_v[a] * u[a][static_cast<std::size_t>(c)];
      for (std::size_t k = 0; k < factors.size(); ++k) {
        const double change =
            h * h * factors[k] * s *
            filter.prints[k].sigma[static_cast<std::size_t>(r) * lattice.width + c];
        variance += change * change;
      }
    }
  }
  return variance * filter.sum_sigma_ratio * filter.sum_sigma_ratio;
}

double StretchVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags) {
  double variance = 0;
  for (const double per_entry : Print(filter).Stretch(lags))
    variance += std::pow(per_entry * filter.stretch_sigma, 2);
  return variance;
}

double LevelVariance(const lightfield::MeasuredFilter& filter, const LagSums& lags) {
  const auto [plus, minus] = Print(filter).DensityOfPrints(lags);
  const double both = plus + minus;
  return 0.5 * filter.level_sigma * filter.level_sigma *
         (both * both + plus * plus + minus * minus);
}

}  // namespace luxfield::reconstruct
