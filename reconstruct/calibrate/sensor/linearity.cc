#include "luxfield/reconstruct/calibrate/sensor/linearity.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "luxfield/core/error.h"

namespace luxfield::reconstruct {
namespace {

constexpr double kLowest = 0.05, kHighest = 0.95;  // of the range, EMVA 1288
constexpr std::size_t kFewestLevels = 4;

struct Level {
  const PairStatistics* pair = nullptr;
  double exposure = 0;                        // H
  double signal = 0;                          // S, the light's alone
  double noise = 0;                           // relative, of S
  double frames_ratio = 0, frames_noise = 0;  // log of the two frames' S / H, and its noise
};

std::vector<Level> LevelsInRange(std::span<const PairStatistics> pairs,
                                 const PhotonTransfer& transfer, int channel, bool by_monitor) {
  double brightest = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (!pairs[k].dark && pairs[k].channel == channel && !transfer.points[k].saturated)
      brightest = std::max(brightest, pairs[k].mean());
  const double offset = transfer.offset_dn.value;
  const double range =
      (transfer.saturation_dn ? transfer.saturation_dn->value : brightest) - offset;
  std::vector<Level> levels;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const PairStatistics& pair = pairs[k];
    if (pair.dark || pair.channel != channel || transfer.points[k].saturated) continue;
    const double dark = offset + transfer.dark_dn_per_s.value * pair.exposure_s;
    const double a = pair.mean_a - dark, b = pair.mean_b - dark;
    const double level = (pair.mean() - offset) / range;
    if (level < kLowest || level > kHighest || !(a > 0 && b > 0)) continue;
    const double ha = pair.exposure_s * (by_monitor ? pair.meter_a : 1),
                 hb = pair.exposure_s * (by_monitor ? pair.meter_b : 1);
    const double v = transfer.points[k].variance_dn2 + (pair.quantised ? 1.0 / 12 : 0.0);
    const double frame_noise =
        std::sqrt(std::max(v, 0.0) / static_cast<double>(pair.pixels)) / (0.5 * (a + b));
    levels.push_back({&pair, 0.5 * (ha + hb), 0.5 * (a + b), frame_noise / std::sqrt(2.0),
                      std::log(a / ha * hb / b), frame_noise * std::sqrt(2.0)});
  }
  return levels;
}

// Excess of the pairs' frame-to-frame differences over their noise.
double Repeatability(const std::vector<Level>& levels) {
  double chi_squared = 0, excess = 0;
  for (const Level& level : levels) {
    const double square = level.frames_ratio * level.frames_ratio,
                 noise = level.frames_noise * level.frames_noise;
    chi_squared += square / noise;
    excess += 0.5 * (square - noise);
  }
  const auto n = static_cast<double>(levels.size());
  return chi_squared > n + 3 * std::sqrt(2 * n) && excess > 0 ? std::sqrt(excess / n) : 0;
}

}  // namespace

Linearity MeasureLinearity(std::span<const PairStatistics> pairs, const PhotonTransfer& transfer,
                           int channel) {
  Linearity result;
  result.by_monitor = std::all_of(pairs.begin(), pairs.end(), [&](const PairStatistics& pair) {
    return pair.dark || pair.channel != channel || (pair.meter_a > 0 && pair.meter_b > 0);
  });
  const std::vector<Level> levels = LevelsInRange(pairs, transfer, channel, result.by_monitor);
  std::set<double> times;
  for (const Level& level : levels) times.insert(level.pair->exposure_s);
  if (times.size() < kFewestLevels)
    throw InputError(fmt::format(
        "only {} exposure times of flats lie between 5 % and 95 % of the range, linearity needs "
        "{}; take more levels there",
        times.size(), kFewestLevels));
  result.repeatability = Repeatability(levels);

  const auto n = static_cast<Eigen::Index>(levels.size());
  // Relative rows (1, H) / S against 1; H scaled to order 1.
  double scale = 0;
  for (const Level& level : levels) scale = std::max(scale, level.exposure);
  Eigen::MatrixX2d rows(n, 2);
  Eigen::VectorXd sigma(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Level& level = levels[k];
    rows.row(k) << 1 / level.signal, level.exposure / scale / level.signal;
    sigma[k] = std::hypot(level.noise, result.repeatability / std::sqrt(2.0));
  }
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(n);
  const Eigen::Matrix2d inverse = (rows.transpose() * rows).inverse();
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(n, n) - rows * inverse * rows.transpose();
  const Eigen::VectorXd residual = rest * one;  // relative to S
  for (Eigen::Index k = 0; k < n; ++k) {
    LinearityPoint point{levels[k].pair->exposure_s, levels[k].signal,
                         residual[k] / (1 - residual[k]),
                         rest.row(k).transpose().cwiseProduct(sigma).norm()};
    if (std::abs(point.deviation) >= std::abs(result.largest.deviation)) result.largest = point;
    result.points.push_back(point);
  }

  const Eigen::MatrixX2d white = sigma.cwiseInverse().asDiagonal() * rows;
  const Eigen::VectorXd target = sigma.cwiseInverse();
  const Eigen::Matrix2d covariance = (white.transpose() * white).inverse();
  const Eigen::Vector2d line = covariance * (white.transpose() * target);
  result.chi_squared = (target - white * line).squaredNorm();
  result.degrees = static_cast<int>(n) - 2;
  // a0 / a1 in seconds; where H counts the monitor, at the monitor's mean reading.
  double per_second = 0;
  for (const Level& level : levels)
    per_second += level.exposure / level.pair->exposure_s / static_cast<double>(n);
  const double to_seconds = scale / per_second;
  const Eigen::Vector2d gradient =
      Eigen::Vector2d(1 / line[1], -line[0] / (line[1] * line[1])) * to_seconds;
  result.exposure_offset_s = {line[0] / line[1] * to_seconds,
                              std::sqrt(gradient.dot(covariance * gradient))};
  return result;
}

}  // namespace luxfield::reconstruct
