#include "luxfield/environment/hosek_wilkie.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/environment/hosek_wilkie_data.h"

namespace luxfield::environment {
namespace {

constexpr int kControlPoints = 6, kTurbidities = 10;
constexpr double kLumenPerWatt = 683;

// Weights of a table's entries at one state of the sky.
struct Weights {
  std::array<double, 2> albedo{}, turbidity{};
  int turbidity_index = 0;  // of the lower one
  std::array<double, kControlPoints> bezier{};
};

Weights FindWeights(double sun_elevation_deg, double turbidity, double ground_albedo) {
  Weights w;
  w.albedo = {1 - ground_albedo, ground_albedo};
  w.turbidity_index = std::min(static_cast<int>(turbidity) - 1, kTurbidities - 2);
  const double above = turbidity - (w.turbidity_index + 1);
  w.turbidity = {1 - above, above};
  constexpr double kBinomial[] = {1, 5, 10, 10, 5, 1};
  const double t = std::cbrt(sun_elevation_deg / 90);
  for (int k = 0; k < kControlPoints; ++k)
    w.bezier[k] = kBinomial[k] * std::pow(t, k) * std::pow(1 - t, kControlPoints - 1 - k);
  return w;
}

// Entry `index` of `stride` that a table has for each control point.
double Interpolate(std::span<const double> table, const Weights& w, int stride, int index) {
  double sum = 0;
  for (int albedo = 0; albedo < 2; ++albedo)
    for (int t = 0; t < 2; ++t)
      for (int k = 0; k < kControlPoints; ++k) {
        const int block = (albedo * kTurbidities + w.turbidity_index + t) * kControlPoints + k;
        sum += w.albedo[albedo] * w.turbidity[t] * w.bezier[k] * table[block * stride + index];
      }
  return sum;
}

}  // namespace

HosekWilkieSky::HosekWilkieSky(double sun_elevation_deg, double turbidity, double ground_albedo) {
  if (!(turbidity >= kLeastTurbidity && turbidity <= kLargestTurbidity))
    throw InputError(fmt::format(
        "turbidity {} is out of reach; choose {} (no haze), 2 (very clear) to {} (hazy)", turbidity,
        kLeastTurbidity, kLargestTurbidity));
  if (!(ground_albedo >= 0 && ground_albedo <= 1))
    throw InputError(fmt::format("ground albedo {} must be from 0 to 1", ground_albedo));
  if (!(sun_elevation_deg >= 0 && sun_elevation_deg <= 90))
    throw InputError(fmt::format(
        "the sun stands {:.2f} degrees below the horizon; the sky is known by day only: choose "
        "another time",
        -sun_elevation_deg));
  const Weights weights = FindWeights(sun_elevation_deg, turbidity, ground_albedo);
  for (int k = 0; k < 3; ++k) {
    const HosekWilkieTable& table = kHosekWilkieXyz[k];
    for (int c = 0; c < 9; ++c) xyz_[k].c[c] = Interpolate(table.distribution, weights, 9, c);
    xyz_[k].radiance = kLumenPerWatt * Interpolate(table.radiance, weights, 1, 0);
  }
}

core::Rgb HosekWilkieSky::Xyz(double cos_theta, double gamma, double cos_gamma) const {
  const double cos2 = cos_gamma * cos_gamma, zenith = std::sqrt(cos_theta);
  core::Rgb xyz;
  for (int k = 0; k < 3; ++k) {
    const auto& [a, b, c, d, e, f, g, i, h] = xyz_[k].c;
    const double base = 1 + h * h - 2 * h * cos_gamma;
    const double chi = (1 + cos2) / (base * std::sqrt(base));
    const double value = (1 + a * std::exp(b / (cos_theta + 0.01))) *
                         (c + d * std::exp(e * gamma) + f * cos2 + g * chi + i * zenith);
    xyz[k] = std::max(0.0, xyz_[k].radiance * value);
  }
  return xyz;
}

}  // namespace luxfield::environment
