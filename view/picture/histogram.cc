#include "luxfield/view/picture/histogram.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/measures.h"

namespace luxfield::view {
namespace {

constexpr double kDecades = 5;

}  // namespace

Histogram HistogramOf(const core::Image& image, int bins) {
  Histogram histogram;
  histogram.shares.assign(static_cast<std::size_t>(bins), 0);
  std::vector<float> values = core::LuminanceImage(image).data;
  if (values.empty()) return histogram;
  const auto pixels = static_cast<double>(values.size());
  for (const float value : values) histogram.mean += value / pixels;
  std::erase_if(values, [](float value) { return !(value > 0) || !std::isfinite(value); });
  histogram.dark = 1 - static_cast<double>(values.size()) / pixels;
  if (values.empty()) return histogram;
  std::ranges::sort(values);
  const auto rank = [&](double share) {
    return double{values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))]};
  };
  histogram.median = rank(0.5);
  histogram.percentile_99 = rank(0.99);
  histogram.max = values.back();
  histogram.min = histogram.max * std::pow(10, -kDecades);
  for (const float value : values) {
    const double position = 1 + std::log10(value / histogram.max) / kDecades;
    if (position < 0) {
      histogram.below += 1 / pixels;
      continue;
    }
    const int bin = std::clamp(static_cast<int>(position * bins), 0, bins - 1);
    histogram.shares[static_cast<std::size_t>(bin)] += static_cast<float>(1 / pixels);
  }
  return histogram;
}

}  // namespace luxfield::view
