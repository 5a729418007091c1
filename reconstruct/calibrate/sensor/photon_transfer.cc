#include "luxfield/reconstruct/calibrate/sensor/photon_transfer.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

constexpr double kSaturationSigmas = 6;
constexpr double kFloorSigmas = 5;  // of the dark level above 0
constexpr double kLeastVariance_dn2 = 0.49;
constexpr double kPiledUpShare = 0.01;
constexpr int kFewestLevels = 3;

// Parameters in this order: offset b, dark signal q, read variance R, gain g.
enum Parameter { kOffset, kDark, kRead, kGain };
using Parameters = Eigen::Vector4d;

double Rounding(const PairStatistics& pair) { return pair.quantised ? 1.0 / 12 : 0.0; }

// Spread over the pixels of one frame: pattern and noise.
double Spread(const PairStatistics& pair) {
  return std::sqrt(std::max(pair.variance_a, pair.variance_b));
}

// Variance of the rounding error of a mean over pixels with noise of `variance` DN^2, where its
// phase is unknown.
double RoundingVarianceOfMean(double variance) {
  double sum = 0;
  for (int k = 1; k <= 100; ++k) {
    const double frequency = 2 * std::numbers::pi * k;
    sum += 2 * std::exp(-frequency * frequency * variance) / (frequency * frequency);
  }
  return sum;
}

struct Observation {
  double signal = 0;    // S at the present offset
  double variance = 0;  // V - rounding
};

// Light of A over that of B: 1 for darks and where there is too little light to tell.
double LightRatio(const PairStatistics& pair, double dark_level) {
  const double a = pair.mean_a - dark_level, b = pair.mean_b - dark_level;
  const double error = std::sqrt(pair.variance_b / static_cast<double>(pair.pixels));
  return !pair.dark && b > 50 * error && a > 50 * error ? a / b : 1;
}

Observation Observe(const PairStatistics& pair, const Parameters& p) {
  const double ratio = LightRatio(pair, p[kOffset] + p[kDark] * pair.exposure_s),
               r2 = ratio * ratio;
  return {(pair.mean_a - p[kOffset] + r2 * (pair.mean_b - p[kOffset])) / (1 + r2),
          pair.TemporalVariance(ratio) - Rounding(pair)};
}

// Variance of V - (R + g S), as the header has it.
double ResidualVariance(const PairStatistics& pair, double signal, const Parameters& p) {
  const double g = p[kGain], s = std::max(signal, 0.0),
               floor = std::max(p[kRead], 0.0) + Rounding(pair), v = floor + g * s;
  return (2 * v * v + (pair.dark ? g * g * g * s : g * g * floor) / 2) /
         static_cast<double>(pair.pixels);
}

void CheckDarks(std::span<const PairStatistics> pairs) {
  std::set<double> times;
  for (const PairStatistics& pair : pairs) {
    if (!pair.dark) continue;
    times.insert(pair.exposure_s);
    if (pair.quantised && pair.min_dn <= 0 && pair.mean() < kFloorSigmas * Spread(pair))
      throw InputError(
          fmt::format("the dark frames of {} s are cut off at 0 DN (mean {:.3g} DN, noise {:.3g} "
                      "DN); raise the camera's black level (offset)",
                      pair.exposure_s, pair.mean(), Spread(pair)));
  }
  if (times.size() < 2)
    throw InputError(
        fmt::format("darks of {} exposure times; dark current needs two at least, better as many "
                    "as the flats have",
                    times.size()));
}

// Flats that are darker than shorter ones of their channel by more than their noise.
void CheckOrder(std::span<const PairStatistics> pairs) {
  for (const PairStatistics& a : pairs)
    for (const PairStatistics& b : pairs) {
      if (a.dark || b.dark || a.channel != b.channel || !(a.exposure_s < b.exposure_s)) continue;
      const double noise =
          std::sqrt((a.variance_a + b.variance_a) / static_cast<double>(a.pixels)) +
          (a.quantised ? 0.5 : 0);
      if (b.mean() < a.mean() - 6 * noise)
        throw InputError(
            fmt::format("the flat of {} s is darker ({:.6g} DN) than that of {} s ({:.6g} DN); let "
                        "the lamp settle, check that the shutter was open, and capture again",
                        b.exposure_s, b.mean(), a.exposure_s, a.mean()));
    }
}

// Which pairs are near saturation, and its level: the lowest over the channels.
std::optional<Quantity> MarkSaturated(std::span<const PairStatistics> pairs,
                                      std::vector<TransferPoint>& points) {
  std::optional<Quantity> lowest;
  std::set<int> channels;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    points[k].saturated = pairs[k].overflown;
    if (!pairs[k].dark) channels.insert(pairs[k].channel);
  }
  for (const int channel : channels) {
    std::vector<PairStatistics> flats;
    for (const PairStatistics& pair : pairs)
      if (!pair.dark && pair.channel == channel) flats.push_back(pair);
    const auto saturation = FindSaturation(flats);
    if (!saturation) continue;
    if (!lowest || saturation->value < lowest->value) lowest = saturation;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const PairStatistics& pair = pairs[k];
      if (pair.dark || pair.channel != channel) continue;
      const double mean = std::max(pair.mean_a, pair.mean_b);
      points[k].saturated = pair.overflown || pair.max_dn >= saturation->value ||
                            mean + kSaturationSigmas * Spread(pair) >= saturation->value;
    }
  }
  return lowest;
}

// A line through the darks' means and one through the variances, unweighted.
Parameters Start(std::span<const PairStatistics> pairs, const std::vector<TransferPoint>& points) {
  const auto line = [](const std::vector<std::pair<double, double>>& data) {
    double x = 0, y = 0, xx = 0, xy = 0;
    const auto n = static_cast<double>(data.size());
    for (const auto& [a, b] : data) x += a / n, y += b / n;
    for (const auto& [a, b] : data) xx += (a - x) * (a - x), xy += (a - x) * (b - y);
    const double slope = xx > 0 ? xy / xx : 0;
    return std::pair(y - slope * x, slope);
  };
  std::vector<std::pair<double, double>> dark, transfer;
  for (const PairStatistics& pair : pairs)
    if (pair.dark) dark.emplace_back(pair.exposure_s, pair.mean());
  Parameters p = Parameters::Zero();
  std::tie(p[kOffset], p[kDark]) = line(dark);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (!points[k].fitted) continue;
    const Observation o = Observe(pairs[k], p);
    transfer.emplace_back(o.signal, o.variance);
  }
  std::tie(p[kRead], p[kGain]) = line(transfer);
  p[kRead] = std::max(p[kRead], 0.0);
  return p;
}

// The normal equations at p: J^T W J, J^T W residual, and chi-squared.
struct NormalEquations {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double chi_squared = 0;
  int observations = 0;
};

NormalEquations Assemble(std::span<const PairStatistics> pairs,
                         const std::vector<TransferPoint>& points, const Parameters& p) {
  NormalEquations sum;
  // Whitened row: derivative and residual over the standard deviation.
  const auto add = [&](const Eigen::Vector4d& row, double residual) {
    sum.matrix += row * row.transpose();
    sum.right += residual * row;
    sum.chi_squared += residual * residual;
    ++sum.observations;
  };
  const double g = p[kGain];
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const PairStatistics& pair = pairs[k];
    if (points[k].saturated) continue;
    const Observation o = Observe(pair, p);
    if (!pair.dark) {
      if (!points[k].fitted) continue;
      const double sigma = std::sqrt(ResidualVariance(pair, o.signal, p));
      add(Eigen::Vector4d(-g, 0, 1, o.signal) / sigma,
          (o.variance - p[kRead] - g * o.signal) / sigma);
      continue;
    }
    // Mean and variance of a dark pair, with their covariance.
    const auto n = static_cast<double>(pair.pixels);
    const double signal = p[kDark] * pair.exposure_s, s = std::max(signal, 0.0);
    const double v = std::max(p[kRead], 0.0) + Rounding(pair) + g * s;
    const double sigma_mean = std::sqrt(v / (2 * n));
    const Eigen::Vector4d mean_row = Eigen::Vector4d(1, pair.exposure_s, 0, 0) / sigma_mean;
    const double mean_residual = (pair.mean() - p[kOffset] - signal) / sigma_mean;
    add(mean_row, mean_residual);
    if (!points[k].fitted) continue;
    const double sigma = std::sqrt(ResidualVariance(pair, s, p));
    const double correlation = g * g * s / (2 * n) / (sigma * sigma_mean);
    const double rest = std::sqrt(1 - correlation * correlation);
    add((Eigen::Vector4d(0, g * pair.exposure_s, 1, signal) / sigma - correlation * mean_row) /
            rest,
        ((o.variance - p[kRead] - g * signal) / sigma - correlation * mean_residual) / rest);
  }
  return sum;
}

// Inverse of the normal matrix, scaled to a unit diagonal first: the parameters differ by decades.
Eigen::Matrix4d Covariance(const NormalEquations& equations) {
  const Eigen::Vector4d scale = equations.matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix4d scaled = scale.asDiagonal() * equations.matrix * scale.asDiagonal();
  return scale.asDiagonal() * scaled.ldlt().solve(Eigen::Matrix4d::Identity()) * scale.asDiagonal();
}

struct Fit {
  Parameters p;
  Eigen::Matrix4d covariance;
  double chi_squared = 0;
  int degrees = 0;
};

Fit Solve(std::span<const PairStatistics> pairs, const std::vector<TransferPoint>& points) {
  Fit fit;
  fit.p = Start(pairs, points);
  if (!(fit.p[kGain] > 0))
    throw InputError(
        "the noise of the flats does not grow with their signal, so it is not the noise of light; "
        "use more light, or check that flats and darks were not exchanged");
  constexpr int kIterations = 100;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const NormalEquations equations = Assemble(pairs, points, fit.p);
    fit.covariance = Covariance(equations);
    const Parameters step = fit.covariance * equations.right;
    const double before = fit.p[kGain];
    fit.p += step;
    // The gain scales every weight: it must stay above 0 on the way.
    fit.p[kGain] = std::max(fit.p[kGain], 0.1 * before);
    if ((step.array().abs() <= 1e-6 * fit.covariance.diagonal().array().sqrt()).all()) break;
  }
  const NormalEquations equations = Assemble(pairs, points, fit.p);
  fit.covariance = Covariance(equations);
  fit.chi_squared = equations.chi_squared;
  fit.degrees = equations.observations - 4;
  if (!fit.p.allFinite() || !fit.covariance.allFinite())
    throw InputError(
        "the frames do not determine gain and read noise; take flats of more exposure times");
  if (fit.chi_squared > fit.degrees + 4 * std::sqrt(2.0 * fit.degrees) && fit.degrees > 0)
    fit.covariance *= fit.chi_squared / fit.degrees;
  return fit;
}

// The value of a function of the parameters and its error from its gradient.
Quantity Derived(const Fit& fit, double value, const Eigen::Vector4d& gradient) {
  return {value, std::sqrt(std::max(0.0, gradient.dot(fit.covariance * gradient)))};
}

void SetPoints(std::span<const PairStatistics> pairs, const Fit& fit,
               std::vector<TransferPoint>& points) {
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Observation o = Observe(pairs[k], fit.p);
    TransferPoint& point = points[k];
    point.dark = pairs[k].dark;
    point.channel = pairs[k].channel;
    point.exposure_s = pairs[k].exposure_s;
    point.signal_dn = o.signal;
    point.variance_dn2 = o.variance;
    point.model_dn2 = fit.p[kRead] + fit.p[kGain] * o.signal;
    point.sigma_dn2 = std::sqrt(ResidualVariance(pairs[k], o.signal, fit.p));
  }
}

void CheckLevels(std::span<const PairStatistics> pairs, const std::vector<TransferPoint>& points) {
  std::set<double> all, usable;
  bool noise = false;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (pairs[k].dark) continue;
    all.insert(pairs[k].exposure_s);
    noise = noise || pairs[k].TemporalVariance(1) > 0;
    if (points[k].fitted) usable.insert(pairs[k].exposure_s);
  }
  if (all.empty()) throw InputError("no flats among the frames; take pairs of them with light on");
  const bool all_saturated =
      std::all_of(points.begin(), points.end(),
                  [](const TransferPoint& point) { return point.dark || point.saturated; });
  if (all_saturated)
    throw InputError(fmt::format(
        "the flats of all {} exposure times are saturated or next to it; shorten the exposures or "
        "dim the lamp",
        all.size()));
  if (!noise)
    throw InputError(
        "the two flats of every exposure are equal: frames without noise, or one frame delivered "
        "twice; an ideal camera needs no calibration");
  if (static_cast<int>(usable.size()) < kFewestLevels)
    throw InputError(fmt::format(
        "only {} of {} exposure times of flats are unsaturated with a noise above 0.7 DN, three "
        "are needed; take more levels, or raise the camera's gain",
        usable.size(), all.size()));
}

}  // namespace

Quantity RootOf(const Quantity& square) {
  const double value = std::max(square.value, 0.0), root = std::sqrt(value);
  return {root, std::sqrt(value + square.sigma) - root};
}

std::optional<Quantity> FindSaturation(std::span<const PairStatistics> flats) {
  const PairStatistics* longest = nullptr;
  double largest_variance = 0;
  for (const PairStatistics& pair : flats) {
    largest_variance = std::max(largest_variance, pair.TemporalVariance(1));
    if (!longest || pair.exposure_s > longest->exposure_s) longest = &pair;
  }
  if (!longest) return std::nullopt;
  const double spread = Spread(*longest);
  const double sigma = std::max(spread / std::sqrt(static_cast<double>(longest->pixels)),
                                longest->quantised ? 1 / std::sqrt(12.0) : 0.0);
  if (longest->share_at_max >= kPiledUpShare) return Quantity{longest->max_dn, sigma};
  if (longest->TemporalVariance(1) < 0.25 * largest_variance)
    return Quantity{longest->mean() - kSaturationSigmas * spread, sigma};
  return std::nullopt;
}

PhotonTransfer FitPhotonTransfer(std::span<const PairStatistics> pairs) {
  CheckDarks(pairs);
  CheckOrder(pairs);
  PhotonTransfer result;
  result.points.resize(pairs.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) result.points[k].dark = pairs[k].dark;
  result.saturation_dn = MarkSaturated(pairs, result.points);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double variance = pairs[k].TemporalVariance(1) - Rounding(pairs[k]);
    result.points[k].fitted = !result.points[k].saturated && variance > 0 &&
                              (!pairs[k].quantised || variance >= kLeastVariance_dn2);
  }
  CheckLevels(pairs, result.points);
  const Fit fit = Solve(pairs, result.points);
  SetPoints(pairs, fit, result.points);

  const Parameters& p = fit.p;
  const double g = p[kGain];
  result.chi_squared = fit.chi_squared;
  result.degrees = fit.degrees;
  result.gain_dn_per_e = Derived(fit, g, {0, 0, 0, 1});
  if (!(g > 5 * result.gain_dn_per_e.sigma))
    throw InputError(fmt::format(
        "the shot noise of the flats does not stand out of the read noise (gain {:.3g} +- {:.2g} "
        "DN per electron); use more light",
        g, result.gain_dn_per_e.sigma));
  result.gain_e_per_dn = Derived(fit, 1 / g, {0, 0, 0, 1 / (g * g)});
  result.read_variance_dn2 = Derived(fit, p[kRead], {0, 0, 1, 0});
  result.read_variance_e2 =
      Derived(fit, p[kRead] / (g * g), {0, 0, 1 / (g * g), -2 * p[kRead] / (g * g * g)});
  result.read_noise_dn = RootOf(result.read_variance_dn2);
  result.read_noise_e = RootOf(result.read_variance_e2);
  result.read_noise_resolved = result.read_variance_e2.value > 3 * result.read_variance_e2.sigma;
  result.offset_dn = Derived(fit, p[kOffset], {1, 0, 0, 0});
  result.dark_dn_per_s = Derived(fit, p[kDark], {0, 1, 0, 0});
  result.dark_current_e_per_s = Derived(fit, p[kDark] / g, {0, 1 / g, 0, -p[kDark] / (g * g)});
  if (std::any_of(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.quantised; })) {
    const double least = p[kRead] - 2 * result.read_variance_dn2.sigma;
    const double rounding = RoundingVarianceOfMean(std::max(least, 0.0));
    double shortest = std::numeric_limits<double>::infinity(), longest = 0;
    for (const PairStatistics& pair : pairs) {
      if (!pair.dark) continue;
      shortest = std::min(shortest, pair.exposure_s);
      longest = std::max(longest, pair.exposure_s);
    }
    const double slope = std::sqrt(2 * rounding) / (longest - shortest);
    result.offset_dn.sigma = std::hypot(result.offset_dn.sigma, std::sqrt(rounding));
    result.dark_dn_per_s.sigma = std::hypot(result.dark_dn_per_s.sigma, slope);
    result.dark_current_e_per_s.sigma = std::hypot(result.dark_current_e_per_s.sigma, slope / g);
  }
  if (result.saturation_dn) {
    const double range = result.saturation_dn->value - p[kOffset];
    Quantity capacity = Derived(fit, range / g, {-1 / g, 0, 0, -range / (g * g)});
    capacity.sigma = std::hypot(capacity.sigma, result.saturation_dn->sigma / g);
    result.capacity_e = capacity;
  }
  return result;
}

}  // namespace luxfield::reconstruct
