#include "luxfield/render/film/tone.h"

#include <algorithm>
#include <cmath>

namespace luxfield::render {
namespace {

constexpr double kMiddleGrey = 0.18;

template <typename Curve>
core::Rgb OnLargestChannel(core::Rgb rgb, double average_luminance, const Curve& curve) {
  const double most = *std::ranges::max_element(rgb);
  if (!(most > 0) || !(average_luminance > 0)) return {0, 0, 0};
  const double shown = std::min(curve(most / average_luminance), 1.0);
  for (double& value : rgb) value = std::max(value, 0.0) / most * shown;
  return rgb;
}

}  // namespace

const std::vector<std::pair<std::string, ToneCurve>>& ToneCurves() {
  static const std::vector<std::pair<std::string, ToneCurve>> curves = {
      {"exponential", ToneCurve::kExponential},
      {"hue", ToneCurve::kExponentialHue},
      {"filmic", ToneCurve::kFilmic}};
  return curves;
}

core::Rgb Toned(const core::Rgb& linear, ToneCurve curve, double k, double average_luminance) {
  switch (curve) {
    case ToneCurve::kExponentialHue:
      return ExponentialHueTone(linear, k, average_luminance);
    case ToneCurve::kFilmic:
      return FilmicTone(linear, k, average_luminance);
    case ToneCurve::kExponential:
      break;
  }
  return core::ExponentialTone(linear, k, average_luminance);
}

core::Rgb ExponentialHueTone(const core::Rgb& linear, double k, double average_luminance) {
  return OnLargestChannel(linear, average_luminance, [&](double m) { return -std::expm1(-k * m); });
}

core::Rgb FilmicTone(const core::Rgb& linear, double k, double average_luminance) {
  return OnLargestChannel(linear, average_luminance, [&](double m) {
    const double x = std::min(kMiddleGrey * k * m, 1e6);  // the curve is above 1 long before
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  });
}

}  // namespace luxfield::render
