#include "luxfield/reconstruct/calibrate/response/response_curve.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace luxfield::reconstruct {
namespace {

double Lerp(const std::vector<double>& values, const Place& place) {
  return (1 - place.f) * values[place.k] + place.f * values[place.k + 1];
}

double LerpClamped(const std::vector<double>& positions, const std::vector<double>& values,
                   double x) {
  if (values.size() == 1) return values[0];
  Place place = FindPlace(positions, x);
  place.f = std::clamp(place.f, 0.0, 1.0);
  return Lerp(values, place);
}

// Between nodes of codes, in ln z.
Place LogPlace(const std::vector<double>& code, double z) {
  Place place = FindPlace(code, z);
  place.f = std::log(z / code[place.k]) / std::log(code[place.k + 1] / code[place.k]);
  return place;
}

}  // namespace

Place FindPlace(const std::vector<double>& positions, double x) {
  const auto above = std::upper_bound(positions.begin(), positions.end(), x);
  const auto last = static_cast<std::ptrdiff_t>(positions.size()) - 2;
  const auto k = std::clamp<std::ptrdiff_t>(above - positions.begin() - 1, 0, last);
  return {static_cast<int>(k), (x - positions[k]) / (positions[k + 1] - positions[k])};
}

double ResponseCurve::LogExposure(double z) const { return Lerp(log_exposure, LogPlace(code, z)); }

double ResponseCurve::Code(double log_exposure_) const {
  const Place place = FindPlace(log_exposure, log_exposure_);
  return code[place.k] * std::pow(code[place.k + 1] / code[place.k], place.f);
}

double ResponseCurve::Sigma(double z) const { return LerpClamped(code, sigma, z); }

double ResponseCurve::Noise(double z) const {
  if (z <= noise_code.front()) return noise.front() * noise_code.front() / std::max(z, 0.5);
  if (z >= noise_code.back()) return noise.back();
  const int k = FindPlace(noise_code, z).k;
  const double a = LogitCode(noise_code[k], saturation_code),
               b = LogitCode(noise_code[k + 1], saturation_code),
               f = (LogitCode(z, saturation_code) - a) / (b - a);
  return noise[k] * std::pow(noise[k + 1] / noise[k], f);
}

double LogitCode(double z, double saturation_code) { return std::log(z / (saturation_code - z)); }

std::vector<double> CurveNodes(double saturation_code, double reference_code, int count) {
  const double low = LogitCode(1, saturation_code),
               high = LogitCode(saturation_code - 1, saturation_code);
  std::set<double> nodes{reference_code};
  if (count >= saturation_code - 1)
    for (double z = 1; z < saturation_code; ++z) nodes.insert(z);
  else
    for (int k = 0; k < count; ++k) {
      const double u = low + (high - low) * k / (count - 1);
      nodes.insert(std::round(saturation_code / (1 + std::exp(-u))));
    }
  return {nodes.begin(), nodes.end()};
}

}  // namespace luxfield::reconstruct
