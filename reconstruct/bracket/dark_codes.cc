#include "luxfield/reconstruct/bracket/dark_codes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace luxfield::reconstruct {
namespace {

constexpr double kStep = 0.05;     // of sqrt(electrons)
constexpr double kReach = 9;       // standard deviations that sums run over
constexpr double kDithered = 0.5;  // DN of noise: rounding then errs by 0.002 DN at most
constexpr double kSmooth = 8;      // DN of noise: codes are as good as a continuum, to 1e-3 DN

double BelowNormal(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

struct Conditional {
  double mean = 0, square = 0;  // of the code, given its analogue mean
};

// Code by code.
Conditional Rounded(double mean_dn, double noise_dn) {
  const double reach = kReach * noise_dn + 1;
  const auto first = std::lround(std::max(0.0, mean_dn - reach)),
             last = std::lround(std::max(0.0, mean_dn + reach));
  Conditional c;
  double lower = 0;
  for (long k = first; k <= last; ++k) {
    const auto code = static_cast<double>(k);
    const double upper =
        k < last ? BelowNormal((code + 0.5 - mean_dn) / std::max(noise_dn, 1e-9)) : 1;
    c.mean += (upper - lower) * code;
    c.square += (upper - lower) * code * code;
    lower = upper;
  }
  return c;
}

// A normal clipped at 0, as if codes were a continuum.
Conditional Clipped(double mean_dn, double noise_dn) {
  const double z = mean_dn / noise_dn, above = BelowNormal(z),
               density = std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi);
  return {mean_dn * above + noise_dn * density, (mean_dn * mean_dn + noise_dn * noise_dn) * above +
                                                    mean_dn * noise_dn * density + above / 12};
}

// Above this many electrons the line and the analogue variance hold.
double LinearFrom(const rig::SensorModel& sensor, double margin) {
  const double gain = sensor.gain_dn_per_e, read = sensor.read_noise_dn * sensor.read_noise_dn;
  const double dithered = std::max(0.0, (kDithered * kDithered - read) / (gain * gain));
  // black + gain e = margin sqrt(gain^2 e + read^2): the larger root.
  const double b = 2 * sensor.black_dn - margin * margin * gain,
               c = sensor.black_dn * sensor.black_dn - margin * margin * read;
  const double root = b * b - 4 * c;
  const double clear = root > 0 ? std::max(0.0, (-b + std::sqrt(root)) / (2 * gain)) : 0;
  return std::max(dithered, clear);
}

}  // namespace

DarkCodes::DarkCodes(const rig::SensorModel& sensor, double margin) : sensor_(sensor) {
  const double last = 1.2 * LinearFrom(sensor, margin) + 1;
  const auto entries = static_cast<std::size_t>(std::sqrt(last) / kStep) + 2;
  const double most = std::pow(static_cast<double>(entries) * kStep, 2);
  const auto electrons = static_cast<std::size_t>(most + kReach * std::sqrt(most) + 30);
  std::vector<Conditional> given;
  for (std::size_t n = 0; n <= electrons + 2; ++n) {
    const double mean_dn = sensor.black_dn + sensor.gain_dn_per_e * static_cast<double>(n);
    given.push_back(sensor.read_noise_dn < kSmooth ? Rounded(mean_dn, sensor.read_noise_dn)
                                                   : Clipped(mean_dn, sensor.read_noise_dn));
  }
  for (std::size_t entry = 0; entry < entries; ++entry) {
    const double root = static_cast<double>(entry) * kStep, mean = root * root;
    const double reach = kReach * root;
    const auto first = static_cast<std::size_t>(std::max(0.0, mean - reach)),
               end = std::min(electrons, static_cast<std::size_t>(mean + reach + 30));
    const auto start = static_cast<double>(first);
    double p = mean > 0 ? std::exp(start * std::log(mean) - mean - std::lgamma(start + 1)) : 1;
    double sum = 0, square = 0, slope = 0, curvature = 0;
    for (std::size_t n = first; n <= end; ++n) {
      sum += p * given[n].mean;
      square += p * given[n].square;
      slope += p * (given[n + 1].mean - given[n].mean);
      curvature += p * (given[n + 2].mean - 2 * given[n + 1].mean + given[n].mean);
      p *= mean / (static_cast<double>(n) + 1);
    }
    table_.push_back({sum, std::max(square - sum * sum, 1e-12), slope, curvature});
  }
}

DarkCodes::Moments DarkCodes::At(double electrons) const {
  if (electrons <= 0) {
    Moments m = table_.front();
    m.mean += m.slope * electrons;
    return m;
  }
  const double root = std::sqrt(electrons) / kStep;
  const auto below = static_cast<std::size_t>(root);
  if (below + 1 >= table_.size()) {
    const double gain = sensor_.gain_dn_per_e;
    return {sensor_.black_dn + gain * electrons,
            gain * gain * electrons + sensor_.read_noise_dn * sensor_.read_noise_dn +
                sensor_.quantisation_variance_dn2(),
            gain, 0};
  }
  const auto k = static_cast<double>(below);
  const double low = k * k * kStep * kStep, high = (k + 1) * (k + 1) * kStep * kStep,
               share = (electrons - low) / (high - low);
  const Moments &a = table_[below], &b = table_[below + 1];
  return {std::lerp(a.mean, b.mean, share), std::lerp(a.variance, b.variance, share),
          std::lerp(a.slope, b.slope, share), std::lerp(a.curvature, b.curvature, share)};
}

DarkCodes::Estimate DarkCodes::Solve(std::span<const Sample> samples, double start) const {
  constexpr int kMaxSteps = 20;
  constexpr double kConverged = 1e-6;  // (step / sigma)^2
  Estimate estimate{start, 0, 0};
  double bend = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    double score = 0;
    bend = 0;
    estimate.information = estimate.squared_weights = 0;
    for (const Sample& s : samples) {
      const Moments m = At(s.electrons_per_x * estimate.x + s.dark_electrons);
      const double share = s.electrons_per_x * m.slope / m.variance,
                   weight = share * s.electrons_per_x * m.slope;
      score += share * (s.dn - m.mean);
      bend += share * s.electrons_per_x * s.electrons_per_x * m.curvature;
      estimate.information += weight;
      estimate.squared_weights += weight * weight;
    }
    const double change = score / estimate.information;
    estimate.x += change;
    if (!(change * change * estimate.information > kConverged)) break;
  }
  estimate.x += bend / (2 * estimate.information * estimate.information);
  return estimate;
}

}  // namespace luxfield::reconstruct
