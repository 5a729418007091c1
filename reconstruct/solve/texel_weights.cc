#include "luxfield/reconstruct/solve/texel_weights.h"

#include <algorithm>

namespace luxfield::reconstruct {

std::vector<double> TexelWeights(const lightfield::Basis& basis, double at,
                                 std::span<const double> edges, double blur) {
  const double width = edges[1] - edges[0],
               sharpen = 1.0 / 12 + 0.5 * blur * blur / (width * width);
  const auto integral = [&](double edge, double next) {
    const auto [low, high] = std::minmax(edge, next);
    return basis.Integral(low - at, high - at);
  };
  double before = integral(edges.front() - width, edges.front()),
         here = integral(edges[0], edges[1]);
  std::vector<double> weights;
  for (std::size_t t = 0; t + 1 < edges.size(); ++t) {
    const double after = t + 2 < edges.size() ? integral(edges[t + 1], edges[t + 2])
                                              : integral(edges.back(), edges.back() + width);
    weights.push_back(here - sharpen * (before - 2 * here + after));
    before = here;
    here = after;
  }
  return weights;
}

}  // namespace luxfield::reconstruct
