#include "luxfield/core/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"

namespace luxfield::core {
namespace {

void RequireComparable(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels)
    throw InputError(fmt::format(
        "images differ in shape: {} x {} x {} against {} x {} x {}; compare like with like",
        a.width, a.height, a.channels, b.width, b.height, b.channels));
  const auto finite = [](float v) { return std::isfinite(v); };
  if (!std::all_of(a.data.begin(), a.data.end(), finite) ||
      !std::all_of(b.data.begin(), b.data.end(), finite))
    throw InputError(
        "an image holds NaN or infinity, so no difference exists; render or measure it again");
}

Rgb PixelOf(const Image& image, std::size_t i) {
  const std::size_t n = image.plane_size();
  if (image.channels == 1) return {image.data[i], image.data[i], image.data[i]};
  return {image.data[i], image.data[n + i], image.data[2 * n + i]};
}

double AverageLuminance(const Image& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.plane_size(); ++i) sum += Luminance(PixelOf(image, i));
  return sum / static_cast<double>(std::max<std::size_t>(image.plane_size(), 1));
}

}  // namespace

Image LuminanceImage(const Image& image) {
  Image luminance(image.width, image.height, 1);
  for (std::size_t i = 0; i < image.plane_size(); ++i)
    luminance.data[i] = static_cast<float>(Luminance(PixelOf(image, i)));
  return luminance;
}

Image LabDifference(const Image& a, const Image& b) {
  RequireComparable(a, b);
  const double average = AverageLuminance(b);
  Image out(a.width, a.height, 1);
  for (std::size_t i = 0; i < a.plane_size(); ++i) {
    const Rgb x = LabFromLinear(ExponentialTone(PixelOf(a, i), 1, average));
    const Rgb y = LabFromLinear(ExponentialTone(PixelOf(b, i), 1, average));
    out.data[i] = static_cast<float>(std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]));
  }
  return out;
}

Difference Compare(const Image& a, const Image& b) {
  RequireComparable(a, b);
  const auto count = static_cast<double>(std::max<std::size_t>(b.data.size(), 1));
  Difference result;
  double sum_b = 0;
  for (const float v : b.data) sum_b += v;
  result.mean_reference = sum_b / count;
  const double eps = std::pow(0.01 * result.mean_reference, 2);
  double sum_square = 0, sum_relative = 0, sum_difference = 0;
  for (std::size_t i = 0; i < b.data.size(); ++i) {
    const double d = double{a.data[i]} - b.data[i];
    sum_difference += d;
    sum_square += d * d;
    if (d != 0) sum_relative += d * d / (double{b.data[i]} * b.data[i] + eps);
    result.max_abs = std::max(result.max_abs, std::abs(d));
  }
  const double rmse = std::sqrt(sum_square / count);
  result.rel_rmse = rmse > 0 ? rmse / std::abs(result.mean_reference) : 0;
  result.rel_mse = sum_relative / count;
  result.bias = sum_difference != 0 ? sum_difference / sum_b : 0;
  double lab = 0;
  for (const float v : LabDifference(a, b).data) lab += v;
  result.mean_lab = lab / static_cast<double>(std::max<std::size_t>(a.plane_size(), 1));
  return result;
}

}  // namespace luxfield::core
