#include "luxfield/core/colour.h"

#include <algorithm>
#include <cmath>

namespace luxfield::core {

double SrgbEncode(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

Rgb LabFromLinear(const Rgb& c) {
  // sRGB primaries, white D65 (IEC 61966-2-1).
  const double x = (0.4124564 * c[0] + 0.3575761 * c[1] + 0.1804375 * c[2]) / 0.9504700;
  const double y = 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2];
  const double z = (0.0193339 * c[0] + 0.1191920 * c[1] + 0.9503041 * c[2]) / 1.0888300;
  const auto f = [](double t) {
    constexpr double kEdge = 216.0 / 24389.0;
    return t > kEdge ? std::cbrt(t) : (24389.0 / 27.0 * t + 16) / 116;
  };
  return {116 * f(y) - 16, 500 * (f(x) - f(y)), 200 * (f(y) - f(z))};
}

Rgb ExponentialTone(const Rgb& linear, double k, double average_luminance) {
  Rgb out;
  for (int i = 0; i < 3; ++i)
    out[i] = average_luminance > 0 ? -std::expm1(-k * std::max(linear[i], 0.0) / average_luminance)
                                   : 0.0;
  return out;
}

Rgb FalseColour(double t) {
  // Nodes with steadily rising luminance: night blue, violet, red, orange, pale yellow.
  static constexpr double kNodes[6][3] = {{0.02, 0.02, 0.12}, {0.25, 0.05, 0.45},
                                          {0.60, 0.10, 0.42}, {0.87, 0.28, 0.22},
                                          {0.98, 0.62, 0.12}, {0.99, 0.98, 0.72}};
  const double x = std::clamp(t, 0.0, 1.0) * 5;
  const int i = std::min(static_cast<int>(x), 4);
  const double f = x - i;
  Rgb out;
  for (int c = 0; c < 3; ++c) out[c] = kNodes[i][c] + f * (kNodes[i + 1][c] - kNodes[i][c]);
  return out;
}

}  // namespace luxfield::core
