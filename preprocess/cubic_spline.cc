#include "luxfield/preprocess/cubic_spline.h"

#include <algorithm>
#include <vector>

#include "luxfield/core/parallel.h"

namespace luxfield::preprocess {
namespace {

constexpr std::size_t kLanes = 32;  // neighbouring lines solved together

// `lanes` lines that start at data[0], data[1], ...
void FilterLines(float* data, std::size_t nodes, std::size_t inner, std::size_t lanes) {
  std::vector<double> values((nodes + 2) * lanes), coefficients((nodes + 2) * lanes);
  std::vector<double> ratio(nodes + 2, 0.0);
  const auto f = [&](std::size_t k) { return values.data() + k * lanes; };
  const auto c = [&](std::size_t k) { return coefficients.data() + k * lanes; };
  for (std::size_t k = 1; k <= nodes; ++k)
    for (std::size_t l = 0; l < lanes; ++l) f(k)[l] = static_cast<double>(data[k * inner + l]);
  // Not a knot: the first (last) three values lie on one cubic, whose coefficient at the middle
  // one is f - f'' / 6, and f'' there is their second difference.
  const std::size_t second = 2, last = nodes - 1;
  for (const std::size_t k : {second, last})
    for (std::size_t l = 0; l < lanes; ++l) c(k)[l] = (8 * f(k)[l] - f(k - 1)[l] - f(k + 1)[l]) / 6;
  // Between them c[k - 1] + 4 c[k] + c[k + 1] = 6 f[k], by Thomas' algorithm.
  for (std::size_t k = second + 1; k < last; ++k) {
    ratio[k] = 1 / (4 - ratio[k - 1]);
    for (std::size_t l = 0; l < lanes; ++l) c(k)[l] = (6 * f(k)[l] - c(k - 1)[l]) * ratio[k];
  }
  for (std::size_t k = last; k-- > second + 1;)
    for (std::size_t l = 0; l < lanes; ++l) c(k)[l] -= ratio[k] * c(k + 1)[l];
  // The same equations at the outer two nodes give the outer two coefficients.
  for (std::size_t k : {second, second - 1})
    for (std::size_t l = 0; l < lanes; ++l) c(k - 1)[l] = 6 * f(k)[l] - 4 * c(k)[l] - c(k + 1)[l];
  for (std::size_t k : {last, last + 1})
    for (std::size_t l = 0; l < lanes; ++l) c(k + 1)[l] = 6 * f(k)[l] - 4 * c(k)[l] - c(k - 1)[l];
  for (std::size_t k = 0; k < nodes + 2; ++k)
    for (std::size_t l = 0; l < lanes; ++l) data[k * inner + l] = static_cast<float>(c(k)[l]);
}

}  // namespace

void SplineFromValues(float* data, std::size_t outer, std::size_t nodes, std::size_t inner) {
  const std::size_t pieces = (inner + kLanes - 1) / kLanes;
  core::ParallelFor(outer * pieces, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t first = k % pieces * kLanes;
      FilterLines(data + k / pieces * (nodes + 2) * inner + first, nodes, inner,
                  std::min(kLanes, inner - first));
    }
  });
}

}  // namespace luxfield::preprocess
