#include "luxfield/reconstruct/calibrate/response/response_noise.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "luxfield/reconstruct/calibrate/response/response_curve.h"

namespace luxfield::reconstruct {
namespace {

constexpr double kLargestLeverage = 0.95, kClip = 3;
constexpr std::size_t kLeastInBin = 40;
// E min(x^2, 9) of a standard normal x.
constexpr double kClippedVariance = 0.99501;

double RobustSigma(std::span<const ExposureResidual> residuals) {
  std::vector<double> squares;
  for (const ExposureResidual& r : residuals)
    squares.push_back(r.residual * r.residual / (1 - r.leverage));
  std::vector<double> sorted = squares;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  double variance = *middle / 0.4549;  // the median of chi-squared of one degree
  for (int iteration = 0; iteration < 20; ++iteration) {
    double sum = 0;
    for (const double square : squares) sum += std::min(square, kClip * kClip * variance);
    variance = sum / static_cast<double>(squares.size()) / kClippedVariance;
  }
  return std::sqrt(variance);
}

}  // namespace

ExposureNoise EstimateExposureNoise(std::vector<ExposureResidual> residuals, double saturation_code,
                                    int bins) {
  std::erase_if(residuals, [&](const ExposureResidual& r) {
    return r.leverage > kLargestLeverage || !(r.predicted_code > 0) ||
           !(r.predicted_code < saturation_code);
  });
  ExposureNoise noise;
  if (residuals.size() < kLeastInBin) return noise;
  std::sort(residuals.begin(), residuals.end(),
            [](const ExposureResidual& a, const ExposureResidual& b) {
              return a.predicted_code < b.predicted_code;
            });
  const double low = LogitCode(1, saturation_code),
               high = LogitCode(saturation_code - 1, saturation_code);
  std::size_t begin = 0;
  for (int bin = 0; bin < bins; ++bin) {
    std::size_t end = begin;
    const double edge = low + (high - low) * (bin + 1) / bins;
    while (end < residuals.size() &&
           (bin + 1 == bins || LogitCode(residuals[end].predicted_code, saturation_code) < edge))
      ++end;
    if (end - begin < kLeastInBin) {
      if (bin + 1 < bins) continue;  // joins the next part
      begin = end < kLeastInBin ? 0 : end - kLeastInBin;
    }
    const std::span part(residuals.begin() + static_cast<std::ptrdiff_t>(begin),
                         residuals.begin() + static_cast<std::ptrdiff_t>(end));
    const double code = part[part.size() / 2].predicted_code, sigma = RobustSigma(part);
    begin = end;
    if (!(sigma > 0) || (!noise.code.empty() && code <= noise.code.back())) continue;
    noise.code.push_back(code);
    noise.sigma.push_back(sigma);
  }
  return noise;
}

}  // namespace luxfield::reconstruct
