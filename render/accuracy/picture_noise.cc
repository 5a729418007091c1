#include "luxfield/render/accuracy/picture_noise.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/measures.h"

namespace luxfield::render {
namespace {

constexpr double kMinPower = 0.8, kMaxPower = 2;
constexpr double kFewPixels = 200;
// Samples scatter more than normal noise, for which 1.645 would do: 1.9 holds in 92 % of pictures
// of 100 to 600 samples of `windowed`, 2.2 in 97 %.
constexpr double kMarginSigmas = 2.0;

// What a chi-squared variable of mean 1 and this variance stays below; the formula's largest value
// where it falls again, at less than a fifth of a degree of freedom.
double ChiSquaredBound(double variance) {
  const double deviation = std::min(std::sqrt(variance / 9), 0.5 * kMarginSigmas);
  return std::pow(1 + deviation * (kMarginSigmas - deviation), 3);
}

}  // namespace

double PictureNoise::RelativeError() const {
  return mean_luminance > 0 ? std::sqrt(mean_variance) / mean_luminance : 0;
}

double PictureNoise::Sigma() const {
  return 0.5 * std::sqrt(scale_log_variance + 1 / effective_pixels);
}

double PictureNoise::Margin() const {
  const double relative_variance = 2 / effective_pixels * (1 + 1.0 / degrees);
  return std::min(ChiSquaredBound(relative_variance + scale_log_variance),
                  ChiSquaredBound(relative_variance) / std::min(scale, 1.0));
}

PictureNoise NoiseOf(const Frame& frame, int degrees, core::Image Frame::*variance) {
  double sum = 0, squares = 0, luminance = 0;
  for (const float v : (frame.*variance).data) {
    sum += v;
    squares += double{v} * v;
  }
  for (const float y : core::LuminanceImage(frame.radiance).data) luminance += y;
  const auto count = static_cast<double>((frame.*variance).data.size());
  PictureNoise noise;
  noise.mean_luminance = luminance / count;
  noise.mean_variance = sum / count;
  const double seen = squares > 0 ? sum * sum / squares : count;
  noise.effective_pixels = std::min(count, seen * (1 + 2.0 / degrees * seen / (seen + kFewPixels)));
  noise.degrees = degrees;
  if (variance == &Frame::variance) {
    noise.scale = frame.variance_scale;
    noise.scale_log_variance = frame.scale_log_variance;
  }
  return noise;
}

void VarianceLaw::Add(double k, double v) {
  if (v > 0) points[k] = v;
}

double VarianceLaw::Of(double k) const {
  if (points.empty()) return 0;
  auto right = points.upper_bound(k);
  if (right == points.end()) --right;
  if (right == points.begin() && points.size() > 1) ++right;
  const auto left = right == points.begin() ? right : std::prev(right);
  const double power = left == right ? 1
                                     : std::clamp(std::log(left->second / right->second) /
                                                      std::log(right->first / left->first),
                                                  kMinPower, kMaxPower);
  const auto& [near_k, near_v] = k < right->first ? *left : *right;
  return scale * near_v * std::pow(k / near_k, -power);
}

void VarianceLaw::Anchor(double k, double v) {
  const double expected = Of(k);
  if (expected > 0 && v > 0) scale *= v / expected;
}

}  // namespace luxfield::render
