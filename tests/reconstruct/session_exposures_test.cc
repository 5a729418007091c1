#include "luxfield/reconstruct/merge/session_exposures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using session::FrameRecord;
using session::RawFrame;

constexpr int kWidth = 256, kHeight = 128, kBrackets = 16;
constexpr double kRate_e_per_s = 1600;
const std::vector<double> kTimes_s = {1.0 / 64, 1.0 / 16, 1.0 / 4};

rig::SensorModel Camera() {
  rig::SensorModel sensor;
  sensor.width = kWidth;
  sensor.height = kHeight;
  sensor.bits = 14;
  sensor.gain_dn_per_e = 0.5;
  sensor.read_noise_dn = 6;
  sensor.black_dn = 512;
  sensor.saturation_dn = 16383;
  return sensor;
}

// Electrons and read noise together as one normal.
RawFrame Expose(const rig::SensorModel& sensor, double electrons, std::uint64_t seed,
                std::uint32_t stream) {
  RawFrame frame{kWidth, kHeight, {}, {}};
  core::Random random(seed, stream);
  const double mean = sensor.black_dn + sensor.gain_dn_per_e * electrons,
               sigma =
                   std::hypot(sensor.gain_dn_per_e * std::sqrt(electrons), sensor.read_noise_dn);
  for (int p = 0; p < kWidth * kHeight; ++p)
    frame.dn.push_back(static_cast<std::uint16_t>(std::round(mean + sigma * random.Normal())));
  return frame;
}

// Dim light and one dark frame of each time, whose noise all brackets share and which is as large
// as theirs together: chi-squared of the ratios, which are 1, per degree of freedom.
double ChiSquared(std::uint64_t seed) {
  const rig::SensorModel sensor = Camera();
  std::vector<DarkFrame> darks;
  std::vector<FrameRecord> records;
  for (std::size_t n = 0; n < kTimes_s.size(); ++n) {
    const std::vector<RawFrame> one{Expose(sensor, 0, seed, 1000 + static_cast<unsigned>(n))};
    darks.push_back(AverageDarks(one, kTimes_s[n]));
    records.emplace_back().exposure_s = kTimes_s[n];
  }
  std::vector<const FrameRecord*> bracket;
  for (const FrameRecord& record : records) bracket.push_back(&record);
  SessionExposures estimate(records);
  for (unsigned b = 0; b < kBrackets; ++b) {
    std::vector<RawFrame> frames;
    for (unsigned n = 0; n < kTimes_s.size(); ++n)
      frames.push_back(Expose(sensor, kRate_e_per_s * kTimes_s[n], seed, 10 * b + n));
    std::vector<Exposure> exposures;
    for (std::size_t n = 0; n < frames.size(); ++n)
      exposures.push_back({&frames[n], kTimes_s[n], 1, 1, &darks[n]});
    estimate.Add(sensor, bracket, exposures, {}, MergeExposures(sensor, exposures));
  }
  estimate.Solve();
  double chi_squared = 0, degrees = 0;
  for (const RungExposure& rung : estimate.rungs()) {
    if (rung.ratio.sigma == 0) continue;
    chi_squared += std::pow((rung.ratio.value - 1) / rung.ratio.sigma, 2);
    ++degrees;
  }
  return chi_squared / degrees;
}

TEST(SessionExposures, SigmaHoldsTheNoiseOfDarksThatAllBracketsShare) {
  constexpr int kSeeds = 10;
  double mean = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) mean += ChiSquared(seed) / kSeeds;
  std::printf("chi-squared per degree of freedom %.2f\n", mean);
  // Two ratios a seed, at worst as one.
  EXPECT_NEAR(mean, 1, 4 * std::sqrt(2.0 / kSeeds));
}

// Brackets of a ramp of light without noise, each of its own brightness; `light` of a frame, by
// bracket and exposure, is multiplied in.
struct RampSession {
  static constexpr int kCount = 4;
  std::vector<FrameRecord> records;  // bracket by bracket

  RampSession() {
    for (int b = 0; b < kCount; ++b)
      for (const double time_s : kTimes_s) records.emplace_back().exposure_s = time_s;
  }

  SessionExposures Estimate(const std::vector<double>& light) const {
    const rig::SensorModel sensor = Camera();
    SessionExposures estimate(records);
    for (int b = 0; b < kCount; ++b) {
      std::vector<const FrameRecord*> bracket;
      std::vector<RawFrame> frames(kTimes_s.size());
      for (std::size_t n = 0; n < kTimes_s.size(); ++n) {
        const std::size_t at = b * kTimes_s.size() + n;
        bracket.push_back(&records[at]);
        frames[n] = {kWidth, kHeight, {}, {}};
        for (int p = 0; p < kWidth * kHeight; ++p) {
          const double rate = 2e4 * (1 + b) * (1 + 0.3 * p / (kWidth * kHeight));
          frames[n].dn.push_back(static_cast<std::uint16_t>(
              std::round(sensor.black_dn + sensor.gain_dn_per_e * rate * kTimes_s[n] * light[at])));
        }
      }
      std::vector<Exposure> exposures;
      for (std::size_t n = 0; n < frames.size(); ++n)
        exposures.push_back({&frames[n], kTimes_s[n]});
      estimate.Add(sensor, bracket, exposures, {}, MergeExposures(sensor, exposures));
    }
    estimate.Solve();
    return estimate;
  }
};

// A quantity's light of a frame is divided by the frame's ratio: the judge takes the ratios of
// sessions in which one frame got more or less light, without the formulas.
TEST(SessionExposures, CarryErrorsOfFramesToQuantities) {
  const RampSession session;
  const std::size_t count = session.records.size();
  std::map<const FrameRecord*, double> light;
  std::vector<double> even(count, 1);
  for (std::size_t k = 0; k < count; ++k)
    light[&session.records[k]] = 1 + 0.7 * static_cast<double>((5 * k) % 7);
  const ThroughRatios ratios = session.Estimate(even).Propagate(light);
  EXPECT_GT(ratios.noise_variance, 0);
  const auto quantity = [&](const std::vector<double>& of_frames) {
    const SessionExposures estimate = session.Estimate(of_frames);
    double sum = 0;
    for (const auto& [record, of_frame] : light)
      sum -= of_frame * std::log(estimate.Ratio(*record));
    return sum;
  };
  constexpr double kError = 0.02;
  double largest = 0;
  for (const auto& [record, of_frame] : ratios.light)
    largest = std::max(largest, std::abs(of_frame));
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<double> above = even, below = even;
    above[k] += kError;
    below[k] -= kError;
    const double slope = (quantity(above) - quantity(below)) / (2 * kError);
    EXPECT_NEAR(ratios.light.at(&session.records[k]), slope, 0.02 * largest) << k;
  }
  // What a rung's frames share is found, but for the longest's, at whose word all are taken.
  std::map<double, double> of_time;
  double all = 0;
  for (const auto& [record, of_frame] : light) {
    of_time[record->exposure_s] += of_frame + ratios.light.at(record);
    all += of_frame;
  }
  for (const double time_s : kTimes_s)
    EXPECT_NEAR(of_time.at(time_s), time_s == kTimes_s.back() ? all : 0, 1e-6 * all) << time_s;
}

}  // namespace
}  // namespace luxfield::reconstruct
