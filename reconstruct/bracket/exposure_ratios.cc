#include "luxfield/reconstruct/bracket/exposure_ratios.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace luxfield::reconstruct {
namespace {

constexpr double kHuber = 3;
constexpr int kMaxIterations = 30, kPlainIterations = 3;

// Rungs that pixels link to the reference, directly or through others.
std::vector<bool> Linked(const Eigen::MatrixXd& information, int reference) {
  const auto rungs = static_cast<int>(information.rows());
  std::vector<bool> known(rungs, false);
  std::vector<int> open{reference};
  known[reference] = true;
  while (!open.empty()) {
    const int from = open.back();
    open.pop_back();
    for (int to = 0; to < rungs; ++to)
      if (!known[to] && information(from, to) != 0) {
        known[to] = true;
        open.push_back(to);
      }
  }
  return known;
}

}  // namespace

void ExposureRatios::Add(std::span<const RungSample> pixel) {
  if (pixel.size() < 2) return;
  begin_.push_back(samples_.size());
  samples_.insert(samples_.end(), pixel.begin(), pixel.end());
}

std::span<const RungSample> ExposureRatios::pixel(std::size_t n) const {
  const std::size_t end = n + 1 < begin_.size() ? begin_[n + 1] : samples_.size();
  return std::span(samples_).subspan(begin_[n], end - begin_[n]);
}

ExposureRatios::Result ExposureRatios::Solve(int reference) const {
  Eigen::VectorXd log_ratio = Eigen::VectorXd::Zero(rungs_);
  Result result;
  Eigen::MatrixXd covariance;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(rungs_, rungs_);
    Eigen::VectorXd score = Eigen::VectorXd::Zero(rungs_);
    result.chi_squared = 0;
    double samples = 0;
    const bool robust = iteration >= kPlainIterations;
    for (std::size_t n = 0; n < begin_.size(); ++n) {
      const auto all = pixel(n);
      double weights = 0, sum = 0;
      for (const RungSample& s : all) {
        const double scale = std::exp(log_ratio[s.rung]), w = scale * scale / s.variance;
        weights += w;
        sum += w * s.value / scale;
      }
      const double x = sum / weights;
      for (const RungSample& s : all) {
        const double scale = std::exp(log_ratio[s.rung]), w = scale * scale / s.variance;
        const double residual = (s.value / scale - x) * std::sqrt(w);
        const double share =
            robust ? std::min(1.0, kHuber / std::max(std::abs(residual), 1e-30)) : 1.0;
        result.chi_squared += share * residual * residual * (2 - share);
        ++samples;
        score[s.rung] += share * x * w * (s.value / scale - x);
        information(s.rung, s.rung) += x * x * w;
        for (const RungSample& other : all) {
          const double other_scale = std::exp(log_ratio[other.rung]);
          information(s.rung, other.rung) -=
              x * x * w * other_scale * other_scale / other.variance / weights;
        }
      }
    }
    result.information.assign(information.data(), information.data() + information.size());
    result.known = Linked(information, reference);
    int known = 0;
    for (int j = 0; j < rungs_; ++j) {
      known += result.known[j];
      if (result.known[j] && j != reference) continue;
      information.row(j).setZero();
      information.col(j).setZero();
      information(j, j) = 1;
      score[j] = 0;
    }
    result.degrees = samples - static_cast<double>(begin_.size()) - (known - 1);
    covariance = information.inverse();
    const Eigen::VectorXd step = covariance * score;
    log_ratio += step;
    if (robust && step.cwiseAbs().maxCoeff() < 1e-10) break;
  }
  const double excess =
      result.degrees > 0 ? std::sqrt(std::max(1.0, result.chi_squared / result.degrees)) : 1;
  for (int j = 0; j < rungs_; ++j) {
    const double ratio = std::exp(log_ratio[j]);
    const bool measured = result.known[j] && j != reference;
    result.ratio.push_back({ratio, measured ? ratio * excess * std::sqrt(covariance(j, j)) : 0.0});
  }
  return result;
}

}  // namespace luxfield::reconstruct
