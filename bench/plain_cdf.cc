#include "luxfield/bench/plain_cdf.h"

#include <algorithm>
#include <span>

#include "luxfield/core/random.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::bench {
namespace {

// The first of `sums` above `share` of the last.
int Find(std::span<const float> sums, float share) {
  const auto found = std::upper_bound(sums.begin(), sums.end(), share * sums.back());
  return static_cast<int>(std::min(found, sums.end() - 1) - sums.begin());
}

}  // namespace

PlainCdf::PlainCdf(const lightfield::LightField& field)
    : width_(field.geometry.lattice.width), height_(field.geometry.lattice.height) {
  double all = 0;
  for (int m = 0; m < field.geometry.grid.count(); ++m) {
    const auto image = field.image(m, 0);
    double total = 0;
    for (int row = 0; row < height_; ++row) {
      double sum = 0;
      for (int column = 0; column < width_; ++column) {
        sum += image[static_cast<std::size_t>(row) * width_ + column];
        columns_.push_back(static_cast<float>(sum));
      }
      total += sum;
      rows_.push_back(static_cast<float>(total));
    }
    all += total;
    images_.push_back(static_cast<float>(all));
  }
}

PlainCdf::Texel PlainCdf::Draw(float image, float row, float column) const {
  Texel texel;
  texel.image = Find(images_, image);
  const std::size_t first = static_cast<std::size_t>(texel.image) * height_;
  texel.row = Find(std::span(rows_).subspan(first, height_), row);
  texel.column = Find(std::span(columns_).subspan((first + texel.row) * width_, width_), column);
  return texel;
}

double PlainCdf::SecondsPerDraw(int count, std::uint64_t seed) const {
  core::Random random(seed, 0);
  std::size_t sum = 0;
  const core::Stopwatch stopwatch;
  for (int k = 0; k < count; ++k) {
    const float image = random.UniformFloat(), row = random.UniformFloat();
    const Texel texel = Draw(image, row, random.UniformFloat());
    sum += texel.image + texel.row + texel.column;
  }
  const double seconds = stopwatch.CoreSeconds();
  volatile std::size_t keep = sum;  // so that the draws are made
  static_cast<void>(keep);
  return seconds / count;
}

}  // namespace luxfield::bench
