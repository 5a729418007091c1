#include "luxfield/reconstruct/merge/session_exposures.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "luxfield/core/parallel.h"
#include "luxfield/reconstruct/bracket/merge_shares.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::size_t kPixelsOfABracket = 2048;

std::vector<RungExposure> RungsOf(std::span<const session::FrameRecord> frames) {
  std::vector<RungExposure> rungs;
  for (const session::FrameRecord& record : frames) {
    if (record.kind != session::FrameKind::kPosition) continue;
    const bool there = std::any_of(rungs.begin(), rungs.end(), [&](const RungExposure& rung) {
      return rung.exposure_s == record.exposure_s && rung.attenuation == record.attenuation;
    });
    if (!there) rungs.push_back({record.exposure_s, record.attenuation, {1, 0}, false});
  }
  std::stable_sort(rungs.begin(), rungs.end(), [](const RungExposure& a, const RungExposure& b) {
    return a.exposure_s * a.attenuation > b.exposure_s * b.attenuation;
  });
  return rungs;
}

// Light less dark signal of one sample, in electrons per second.
double Value(const rig::SensorModel& sensor, const Exposure& exposure, double k,
             std::size_t pixel) {
  const double dark = exposure.dark
                          ? exposure.dark->mean_dn[pixel]
                          : sensor.black_dn + sensor.gain_dn_per_e * sensor.dark_current_e_per_s *
                                                  exposure.exposure_s;
  return (exposure.frame->at(pixel) - dark) / k;
}

}  // namespace

SessionExposures::SessionExposures(std::span<const session::FrameRecord> frames)
    : rungs_(RungsOf(frames)) {}

std::size_t SessionExposures::Rung(const session::FrameRecord& record) const {
  const auto found = std::find_if(rungs_.begin(), rungs_.end(), [&](const RungExposure& rung) {
    return rung.exposure_s == record.exposure_s && rung.attenuation == record.attenuation;
  });
  return static_cast<std::size_t>(found - rungs_.begin());
}

void SessionExposures::Add(const rig::SensorModel& sensor,
                           std::span<const session::FrameRecord* const> records,
                           std::span<const Exposure> exposures, const MergeOptions& options,
                           const MergedFrame& merged) {
  const MergeShares shares(sensor, exposures, options, merged);
  std::vector<SampleShare> of_pixel;
  Bracket& bracket = brackets_.emplace_back();
  bracket.records.assign(records.begin(), records.end());
  const std::size_t pixels = merged.mask.size(),
                    step = std::max<std::size_t>(1, pixels / kPixelsOfABracket);
  // Other pixels in every bracket: all brackets share the noise of a pixel's dark frames.
  for (std::size_t p = brackets_.size() % step; p < pixels; p += step) {
    if (merged.mask[p] != 0) continue;
    shares.At(p, &of_pixel);
    std::vector<RungSample>& samples = bracket.pixels.emplace_back();
    for (std::size_t n = 0; n < records.size(); ++n) {
      const SampleShare& s = of_pixel[n];
      if (s.share > 0)
        samples.push_back({static_cast<int>(Rung(*records[n])), Value(sensor, exposures[n], s.k, p),
                           s.photon_variance + s.own_variance + s.dark_variance});
    }
  }
}

ExposureRatios::Result SessionExposures::SolveWithout(std::size_t bracket) const {
  ExposureRatios ratios(static_cast<int>(rungs_.size()));
  for (std::size_t b = 0; b < brackets_.size(); ++b)
    if (b != bracket)
      for (const std::vector<RungSample>& pixel : brackets_[b].pixels) ratios.Add(pixel);
  return ratios.Solve(0);
}

void SessionExposures::Solve() {
  const std::size_t count = brackets_.size();
  const ExposureRatios::Result all = SolveWithout(count);
  std::vector<ExposureRatios::Result> without;
  for (std::size_t b = 0; b < count; ++b) without.push_back(SolveWithout(b));
  information_ = all.information;
  for (std::size_t b = 0; b < count; ++b)
    for (std::size_t k = 0; k < information_.size(); ++k)
      brackets_[b].information.push_back(information_[k] - without[b].information[k]);
  for (std::size_t j = 0; j < rungs_.size(); ++j) {
    RungExposure& rung = rungs_[j];
    rung.ratio = all.ratio[j];
    rung.known = all.known[j];
    double n = 0, sum = 0, squares = 0;  // of the jackknife, about the ratio of all
    for (const ExposureRatios::Result& result : without) {
      if (!result.known[j]) continue;
      const double off = result.ratio[j].value - rung.ratio.value;
      ++n;
      sum += off;
      squares += off * off;
    }
    if (n < 2) continue;
    const double variance = (n - 1) / n * (squares - sum * sum / n);
    rung.ratio.sigma = std::max(rung.ratio.sigma, std::sqrt(std::max(variance, 0.0)));
  }
}

ThroughRatios SessionExposures::Propagate(
    const std::map<const session::FrameRecord*, double>& light) const {
  const auto count = static_cast<Eigen::Index>(rungs_.size());
  Eigen::VectorXd of_rung = Eigen::VectorXd::Zero(count);
  for (const auto& [record, of_frame] : light)
    of_rung[static_cast<Eigen::Index>(Rung(*record))] += of_frame;
  // Ratios that are taken as they are, the first's among them, answer nothing.
  Eigen::MatrixXd l = Eigen::Map<const Eigen::MatrixXd>(information_.data(), count, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    if (k > 0 && rungs_[static_cast<std::size_t>(k)].known) continue;
    l.row(k).setZero();
    l.col(k).setZero();
    l(k, k) = 1;
    of_rung[k] = 0;
  }
  const Eigen::VectorXd answer = -l.ldlt().solve(of_rung);
  ThroughRatios result;
  result.noise_variance = -answer.dot(of_rung);
  for (const Bracket& bracket : brackets_) {
    const Eigen::VectorXd by_rung =
        Eigen::Map<const Eigen::MatrixXd>(bracket.information.data(), count, count) * answer;
    // Frames of one rung in one bracket share its light.
    std::map<std::size_t, double> frames;
    for (const session::FrameRecord* record : bracket.records) ++frames[Rung(*record)];
    for (const session::FrameRecord* record : bracket.records) {
      const std::size_t rung = Rung(*record);
      result.light[record] += by_rung[static_cast<Eigen::Index>(rung)] / frames[rung];
    }
  }
  return result;
}

void SessionExposures::WidenSigma(const rig::SensorModel& sensor,
                                  std::span<const session::FrameRecord* const> records,
                                  std::span<const Exposure> exposures, const MergeOptions& options,
                                  MergedFrame* merged) const {
  std::vector<double> variance;  // of each record's ratio
  for (const session::FrameRecord* record : records) {
    const core::Quantity& ratio = rungs_[Rung(*record)].ratio;
    variance.push_back(std::pow(ratio.sigma / ratio.value, 2));
  }
  const MergeShares shares(sensor, exposures, options, *merged);
  core::ParallelFor(merged->mask.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<SampleShare> of_pixel;
    for (std::size_t p = begin; p < end; ++p) {
      if (!(merged->sigma_e_per_s[p] > 0)) continue;
      shares.At(p, &of_pixel);
      double sum = 0;
      for (std::size_t n = 0; n < variance.size(); ++n)
        sum += of_pixel[n].share * of_pixel[n].share * variance[n];
      merged->sigma_e_per_s[p] = static_cast<float>(
          std::hypot(merged->sigma_e_per_s[p], merged->rate_e_per_s[p] * std::sqrt(sum)));
    }
  });
}

}  // namespace luxfield::reconstruct
