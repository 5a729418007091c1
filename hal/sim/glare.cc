#include "luxfield/hal/sim/glare.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace luxfield::hal::sim {
namespace {

// sum_m k(n - m) line[m] of `count` values `stride` apart: a recursion upwards, one downwards.
void Smear(double a, std::size_t count, std::size_t stride, double* line,
           std::vector<double>& below) {
  double sum = 0;
  for (std::size_t n = 0; n < count; ++n) {
    below[n] = sum;  // of what lies before n
    sum = a * (sum + line[n * stride]);
  }
  sum = 0;
  for (std::size_t n = count; n-- > 0;) {
    const double here = line[n * stride];
    line[n * stride] = (1 - a) / (1 + a) * (below[n] + here + sum);
    sum = a * (sum + here);
  }
}

}  // namespace

void Glare::Veil(int width, int height, std::vector<float>& pixels) const {
  const double a = std::exp(-1 / reach_px);
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  std::vector<double> scattered(pixels.begin(), pixels.end()), below(std::max(columns, rows));
  for (std::size_t r = 0; r < rows; ++r) Smear(a, columns, 1, &scattered[r * columns], below);
  for (std::size_t c = 0; c < columns; ++c) Smear(a, rows, columns, &scattered[c], below);
  for (std::size_t p = 0; p < pixels.size(); ++p)
    pixels[p] = static_cast<float>((1 - share) * pixels[p] + share * scattered[p]);
}

}  // namespace luxfield::hal::sim
