#include "luxfield/reconstruct/bracket/dark_codes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

rig::SensorModel Sensor(double gain, double read_noise_dn, double black_dn) {
  rig::SensorModel sensor;
  sensor.bits = 12;
  sensor.gain_dn_per_e = gain;
  sensor.read_noise_dn = read_noise_dn;
  sensor.black_dn = black_dn;
  sensor.saturation_dn = 4095;
  return sensor;
}

const rig::SensorModel kCoarse = Sensor(0.05, 0.1, 64), kLowBlack = Sensor(0.42, 3.34, 4),
                       kNoisy = Sensor(0.2, 12, 20);

double Code(const rig::SensorModel& sensor, double electrons, core::Random& random) {
  const double n = random.Poisson(electrons);
  return std::max(0.0, std::round(sensor.black_dn + sensor.gain_dn_per_e * n +
                                  sensor.read_noise_dn * random.Normal()));
}

TEST(DarkCodes, MomentsAreThoseOfSimulatedCodes) {
  constexpr int kSamples = 200000;
  std::uint32_t number = 0;
  for (const rig::SensorModel& sensor : {kCoarse, kLowBlack, kNoisy}) {
    const DarkCodes codes(sensor, 5);
    for (const double electrons : {0.0, 0.4, 3.0, 7.5, 11.0, 30.0, 77.0, 5000.0}) {
      core::Random random(31, ++number);
      double sum = 0, squares = 0, fourth = 0;
      const DarkCodes::Moments m = codes.At(electrons);
      for (int n = 0; n < kSamples; ++n) {
        const double off = Code(sensor, electrons, random) - m.mean;
        sum += off;
        squares += off * off;
        fourth += off * off * off * off;
      }
      const double variance = squares / kSamples,
                   scatter = std::sqrt((fourth / kSamples - variance * variance) / kSamples);
      SCOPED_TRACE("seed 31, gain " + std::to_string(sensor.gain_dn_per_e) + ", electrons " +
                   std::to_string(electrons));
      // Of codes that come less than ten times in all samples the scatter is not seen.
      constexpr double kRare = 10.0 / kSamples;
      EXPECT_LT(std::abs(sum / kSamples), 4.5 * std::sqrt(variance / kSamples) + kRare);
      EXPECT_LT(std::abs(variance - m.variance), 4.5 * scatter + 2e-3 * variance + kRare);
      // The slope against differences of the mean.
      const double h = 0.5 + 0.05 * electrons;
      EXPECT_NEAR(m.slope,
                  (codes.At(electrons + h).mean - codes.At(std::max(electrons - h, 0.0)).mean) /
                      (electrons + h - std::max(electrons - h, 0.0)),
                  0.1 * sensor.gain_dn_per_e);
    }
  }
}

TEST(DarkCodes, ContinuesTheLineWhereRoundingIsDithered) {
  for (const rig::SensorModel& sensor : {kCoarse, kLowBlack, kNoisy}) {
    const DarkCodes codes(sensor, 5);
    const double far = 1e5;
    const DarkCodes::Moments line = codes.At(far);
    EXPECT_NEAR(line.mean, sensor.black_dn + sensor.gain_dn_per_e * far, 1e-9);
    // Where the table ends.
    for (double electrons = 50; electrons < 4000; electrons *= 1.02) {
      const DarkCodes::Moments m = codes.At(electrons);
      const double analogue = sensor.black_dn + sensor.gain_dn_per_e * electrons;
      const double sigma = std::sqrt(m.variance);
      if (analogue > 6 * sigma && sigma > 0.6) {
        EXPECT_NEAR(m.mean, analogue, 2e-3 * sigma) << electrons;
      }
    }
  }
}

TEST(DarkCodes, SolvesWithoutBiasToItsStatedInformation) {
  // The linear start, then what the codes say; as MergeExposures does it.
  constexpr int kPixels = 40000;
  const double times_s[] = {4, 1, 0.25, 0.0625};
  std::uint32_t number = 1000;
  for (const rig::SensorModel& sensor : {kCoarse, kLowBlack})
    for (const double x : {30.0, 60.0}) {
      const DarkCodes codes(sensor, 5);
      core::Random random(33, ++number);
      double sum = 0, squares = 0, information = 0;
      for (int n = 0; n < kPixels; ++n) {
        std::vector<DarkCodes::Sample> samples;
        for (const double t : times_s) samples.push_back({Code(sensor, t * x, random), t, 0});
        const double start = (samples[0].dn - sensor.black_dn) / (4 * sensor.gain_dn_per_e);
        const DarkCodes::Estimate estimate = codes.Solve(samples, start);
        sum += estimate.x - x;
        squares += (estimate.x - x) * (estimate.x - x);
        information += estimate.information / kPixels;
      }
      const double spread = std::sqrt(squares / kPixels);
      EXPECT_LT(std::abs(sum / kPixels), 4 * spread / std::sqrt(kPixels) + 3e-4 * x)
          << "seed 33, " << x;
      EXPECT_NEAR(spread * std::sqrt(information), 1, 4 / std::sqrt(2.0 * kPixels) + 0.02);
    }
}

}  // namespace
}  // namespace luxfield::reconstruct
