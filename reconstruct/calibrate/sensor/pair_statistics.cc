#include "luxfield/reconstruct/calibrate/sensor/pair_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"

namespace luxfield::reconstruct {
namespace {

using session::RawFrame;

constexpr std::size_t kFewestPixels = 100;

void CheckSizes(const RawFrame& a, const RawFrame& b) {
  if (a.width != b.width || a.height != b.height || a.dn.size() != b.dn.size() ||
      a.value.size() != b.value.size())
    throw InputError(
        fmt::format("two frames of a pair have {} x {} and {} x {} pixels or different kinds of "
                    "numbers; take both with one camera setting",
                    a.width, a.height, b.width, b.height));
}

// Calls row_sum(row) for every row in parallel; the results in order.
template <typename Sums, typename RowSum>
std::vector<Sums> PerRow(int height, RowSum&& row_sum) {
  std::vector<Sums> rows(static_cast<std::size_t>(height));
  core::ParallelFor(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) rows[row] = row_sum(row);
  });
  return rows;
}

float Median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

PairStatistics MeasurePair(const RawFrame& a, const RawFrame& b, const PixelMask& mask) {
  CheckSizes(a, b);
  if (mask.size() != a.size())
    throw InputError(fmt::format(
        "a frame of {} x {} pixels is of another size than the frames before; calibrate one camera "
        "at a time",
        a.width, a.height));
  const auto first = std::find(mask.begin(), mask.end(), 1);
  const double pivot =
      first == mask.end() ? 0 : a.at(static_cast<std::size_t>(first - mask.begin()));
  struct Sums {
    std::size_t count = 0, at_max = 0;
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    float low = std::numeric_limits<float>::infinity(), high = -low;
  };
  const auto rows = PerRow<Sums>(a.height, [&](std::size_t row) {
    Sums s;
    const std::size_t begin = row * static_cast<std::size_t>(a.width), end = begin + a.width;
    for (std::size_t p = begin; p < end; ++p) {
      if (!mask[p]) continue;
      const float ya = a.at(p), yb = b.at(p);
      const double da = ya - pivot, db = yb - pivot;
      ++s.count;
      s.a += da;
      s.b += db;
      s.aa += da * da;
      s.bb += db * db;
      s.ab += da * db;
      for (const float y : {ya, yb}) {
        s.low = std::min(s.low, y);
        if (y > s.high) s.high = y, s.at_max = 0;
        s.at_max += y == s.high;
      }
    }
    return s;
  });
  Sums sum;
  for (const Sums& row : rows) {
    sum.count += row.count;
    sum.a += row.a;
    sum.b += row.b;
    sum.aa += row.aa;
    sum.bb += row.bb;
    sum.ab += row.ab;
    sum.low = std::min(sum.low, row.low);
    if (row.high > sum.high) sum.high = row.high, sum.at_max = 0;
    if (row.high == sum.high) sum.at_max += row.at_max;
  }
  if (sum.count < kFewestPixels)
    throw InputError(fmt::format(
        "only {} pixels of a frame are usable; a calibration needs {} at least, better 1e5",
        sum.count, kFewestPixels));
  const auto n = static_cast<double>(sum.count);
  const double a_mean = sum.a / n, b_mean = sum.b / n;
  PairStatistics result;
  result.pixels = sum.count;
  result.mean_a = pivot + a_mean;
  result.mean_b = pivot + b_mean;
  result.variance_a = (sum.aa - n * a_mean * a_mean) / (n - 1);
  result.variance_b = (sum.bb - n * b_mean * b_mean) / (n - 1);
  result.covariance = (sum.ab - n * a_mean * b_mean) / (n - 1);
  result.min_dn = sum.low;
  result.max_dn = sum.high;
  result.share_at_max = static_cast<double>(sum.at_max) / (2 * n);
  result.quantised = a.value.empty();
  return result;
}

std::vector<std::pair<int, int>> FindOutliers(const RawFrame& a, const RawFrame& b,
                                              double threshold) {
  CheckSizes(a, b);
  const int width = a.width, height = a.height;
  std::vector<float> mean(a.size()), deviation(a.size());
  for (std::size_t p = 0; p < mean.size(); ++p) mean[p] = 0.5f * (a.at(p) + b.at(p));
  core::ParallelFor(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    std::array<float, 8> around{};
    for (auto row = static_cast<int>(begin); row < static_cast<int>(end); ++row)
      for (int column = 0; column < width; ++column) {
        std::size_t count = 0;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
          for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
            if (r != row || c != column)
              around[count++] = mean[static_cast<std::size_t>(r) * width + c];
        const auto end_of_count = around.begin() + static_cast<std::ptrdiff_t>(count);
        const auto middle = around.begin() + static_cast<std::ptrdiff_t>(count / 2);
        std::nth_element(around.begin(), middle, end_of_count);
        // Of an even number (3, 5 or 8 neighbours, or fewer in strips) the mean of the middle two.
        const float median = count == 0 ? 0
                             : count % 2 != 0
                                 ? *middle
                                 : 0.5f * (*middle + *std::max_element(around.begin(), middle));
        const std::size_t p = static_cast<std::size_t>(row) * width + column;
        deviation[p] = mean[p] - median;
      }
  });
  std::vector<float> size(deviation.size());
  for (std::size_t p = 0; p < size.size(); ++p) size[p] = std::abs(deviation[p]);
  const double floor_dn = a.value.empty() ? 0.5 : 0;
  const double limit = threshold * std::max(floor_dn, 1.4826 * static_cast<double>(Median(size)));
  std::vector<std::pair<int, int>> outliers;
  for (std::size_t p = 0; p < deviation.size(); ++p)
    if (std::abs(deviation[p]) > limit)
      outliers.emplace_back(static_cast<int>(p) / width, static_cast<int>(p) % width);
  return outliers;
}

PatternVariance MeasurePrnuSquared(const RawFrame& flat_a, const RawFrame& flat_b,
                                   const RawFrame& dark_a, const RawFrame& dark_b,
                                   const PixelMask& mask) {
  CheckSizes(flat_a, flat_b);
  CheckSizes(dark_a, dark_b);
  CheckSizes(flat_a, dark_a);
  const int width = flat_a.width, height = flat_a.height;
  // `cross`: products of the two frames, free of noise; `all`: the mean of their own squares.
  struct Sums {
    double count = 0, light = 0, signal = 0, cross = 0, all = 0;
  };
  const auto rows = PerRow<Sums>(height, [&](std::size_t row) {
    Sums s;
    if (row == 0 || static_cast<int>(row) + 1 >= height) return s;
    for (int column = 1; column + 1 < width; ++column) {
      const std::size_t p = row * width + column;
      const std::array<std::size_t, 4> around{p - width, p + width, p - 1, p + 1};
      bool good = mask[p];
      for (const std::size_t q : around) good = good && mask[q];
      if (!good) continue;
      const auto light = [&](const RawFrame& flat, const RawFrame& dark, std::size_t q) {
        return static_cast<double>(flat.at(q)) - dark.at(q);
      };
      const double ya = light(flat_a, dark_a, p), yb = light(flat_b, dark_b, p);
      double ha = ya, hb = yb;
      for (const std::size_t q : around) {
        ha -= 0.25 * light(flat_a, dark_a, q);
        hb -= 0.25 * light(flat_b, dark_b, q);
      }
      s.count += 1;
      s.light += ya + yb;
      s.signal += ya * yb;
      s.cross += ha * hb;
      s.all += 0.5 * (ha * ha + hb * hb);
    }
    return s;
  });
  Sums sum;
  for (const Sums& s : rows) {
    sum.count += s.count;
    sum.light += s.light;
    sum.signal += s.signal;
    sum.cross += s.cross;
    sum.all += s.all;
  }
  constexpr double kStencilNorm = 1.25, kStencilOverlap = 1.69;
  if (sum.count < static_cast<double>(kFewestPixels))
    throw InputError(
        fmt::format("only {} pixels have good neighbours all around; PRNU needs {} at least",
                    sum.count, kFewestPixels));
  const double pattern = sum.cross / kStencilNorm, signal = sum.signal - pattern;
  if (!(sum.light > 0 && signal > 0))
    throw InputError(
        "the flats are no brighter than the darks: PRNU needs light; raise it or the exposure");
  PatternVariance result;
  result.value = pattern / signal;
  const double fixed = std::max(result.value, 0.0),
               total = std::max(sum.all / kStencilNorm / signal, fixed);
  result.sigma = std::sqrt(kStencilOverlap / sum.count * (total * total + fixed * fixed));
  return result;
}

}  // namespace luxfield::reconstruct
