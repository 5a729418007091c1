#include "luxfield/hal/sim/sensor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace luxfield::hal::sim {
namespace {

constexpr std::uint64_t kSeed = 71;

SimulatedSensor Quiet() {
  SimulatedSensor m;
  m.width = 200;
  m.height = 150;
  m.bits = 32;
  m.black_dn = 100;
  m.saturation_dn = 4000;
  m.gain_dn_per_e = 0.5;
  m.responsivity_e_per_s_per_w_m2 = {1000};
  return m;
}

std::vector<float> Uniform(const SimulatedSensor& m, float irradiance) {
  return std::vector<float>(static_cast<std::size_t>(m.width) * m.height, irradiance);
}

struct Moments {
  double mean = 0, variance = 0;
};
Moments MomentsOf(const session::RawFrame& frame) {
  Moments m;
  const auto n = static_cast<double>(frame.size());
  for (std::size_t k = 0; k < frame.size(); ++k) m.mean += frame.at(k) / n;
  for (std::size_t k = 0; k < frame.size(); ++k)
    m.variance += (frame.at(k) - m.mean) * (frame.at(k) - m.mean) / (n - 1);
  return m;
}

// Mean by z-test, variance by the normal approximation of chi-squared; `kurtosis` is the fourth
// standardised moment.
void ExpectMoments(const session::RawFrame& frame, double mean, double variance,
                   double kurtosis = 3) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  const Moments m = MomentsOf(frame);
  const auto n = static_cast<double>(frame.size());
  EXPECT_LT(std::abs(m.mean - mean) / std::sqrt(variance / n), 4) << m.mean << " for " << mean;
  EXPECT_LT(std::abs(m.variance / variance - 1) / std::sqrt((kurtosis - 1) / n), 4)
      << m.variance << " for " << variance;
}

TEST(Sensor, WithoutErrorsItIsExact) {
  const SimulatedSensor m = Quiet();
  const auto frame = Sensor(m, kSeed).Expose(Uniform(m, 0.25f), 1, 0, 0.01, 0);
  for (const float dn : frame.value)
    EXPECT_FLOAT_EQ(dn, 100 + 0.5f * 2.5f);  // 1000 * 0.25 * 0.01 electrons
}

TEST(Sensor, PhotonNoiseIsPoisson) {
  SimulatedSensor m = Quiet();
  m.photon_noise = true;
  for (const double electrons : {0.3, 5.0, 40.0, 2000.0}) {
    const auto frame =
        Sensor(m, kSeed).Expose(Uniform(m, static_cast<float>(electrons)), 1, 0, 1e-3, 1);
    ExpectMoments(frame, 100 + 0.5 * electrons, 0.25 * electrons, 3 + 1 / electrons);
  }
}

TEST(Sensor, ReadNoiseAndQuantisation) {
  SimulatedSensor m = Quiet();
  m.bits = 12;
  m.read_noise_dn = 1.5;
  ExpectMoments(Sensor(m, kSeed).Expose({}, 0, 0, 1, 1), 100, 1.5 * 1.5 + 1.0 / 12);
}

TEST(Sensor, DarkCurrentGrowsWithTimeAndIsShotNoiseToo) {
  SimulatedSensor m = Quiet();
  m.photon_noise = true;
  m.dark_current_e_per_s = 20;
  ExpectMoments(Sensor(m, kSeed).Expose({}, 0, 0, 4, 1), 100 + 0.5 * 80, 0.25 * 80, 3 + 1.0 / 80);
}

TEST(Sensor, PrnuIsAFixedPattern) {
  SimulatedSensor m = Quiet();
  m.prnu = 0.02;
  const Sensor sensor(m, kSeed);
  const auto a = sensor.Expose(Uniform(m, 2), 1, 0, 1, 1),
             b = sensor.Expose(Uniform(m, 2), 1, 0, 1, 2);
  EXPECT_EQ(a.value, b.value);
  ExpectMoments(a, 100 + 1000, 1000 * 1000 * 0.02 * 0.02);
}

TEST(Sensor, HotPixelsAreWhereTheCalibrationSaysAndOnlyThere) {
  SimulatedSensor m = Quiet();
  m.hot_pixels = 7;
  m.hot_current_e_per_s = 100;
  const Sensor sensor(m, kSeed);
  ASSERT_EQ(sensor.hot_pixels().size(), 7u);
  auto frame = sensor.Expose({}, 0, 0, 2, 1);
  for (const auto& [row, column] : sensor.hot_pixels()) {
    float& dn = frame.value[static_cast<std::size_t>(row) * m.width + column];
    EXPECT_FLOAT_EQ(dn, 100 + 0.5f * 200);
    dn = 100;
  }
  for (const float dn : frame.value) EXPECT_EQ(dn, 100);
}

TEST(Sensor, VignettingFallsWithTheSquareOfTheRadius) {
  SimulatedSensor m = Quiet();
  m.corner_loss = 0.3;
  const Sensor sensor(m, kSeed);
  const std::vector<float> v = sensor.Vignetting();
  EXPECT_NEAR(v[0], 0.7, 0.3 * 0.015);  // a pixel's centre is not quite the corner
  EXPECT_NEAR(v[m.height / 2 * m.width + m.width / 2], 1, 1e-4);
  const auto frame = sensor.Expose(Uniform(m, 1), 1, 0, 1, 1);
  for (std::size_t k = 0; k < frame.size(); ++k)
    EXPECT_NEAR(frame.value[k], 100 + 500 * v[k], 1e-3);
}

TEST(Sensor, SaturatesAndClipsToTheAdc) {
  SimulatedSensor m = Quiet();
  m.bits = 12;
  for (const auto dn : Sensor(m, kSeed).Expose(Uniform(m, 1e6f), 1, 0, 1, 1).dn)
    ASSERT_EQ(dn, 4000);
  m.black_dn = 0;
  m.read_noise_dn = 3;
  std::size_t zeros = 0;
  for (const auto dn : Sensor(m, kSeed).Expose({}, 0, 0, 1, 1).dn) zeros += dn == 0;
  EXPECT_GT(zeros, 14000u);  // the lower half of the noise, plus what rounds to 0; 15000 +- 87
}

TEST(Sensor, NoiseDependsOnSeedAndStreamOnly) {
  SimulatedSensor m = Quiet();
  m.read_noise_dn = 1;
  const Sensor sensor(m, kSeed);
  EXPECT_EQ(sensor.Expose({}, 0, 0, 1, 5).value, sensor.Expose({}, 0, 0, 1, 5).value);
  EXPECT_NE(sensor.Expose({}, 0, 0, 1, 5).value, sensor.Expose({}, 0, 0, 1, 6).value);
  EXPECT_NE(sensor.Expose({}, 0, 0, 1, 5).value, Sensor(m, kSeed + 1).Expose({}, 0, 0, 1, 5).value);
}

TEST(Sensor, OverflowRunsAlongTheColumn) {
  SimulatedSensor m = Quiet();
  m.blooming_share = 0.4;
  m.blooming_px = 3;
  const double full = (m.saturation_dn - m.black_dn) / m.gain_dn_per_e;  // 7800 electrons
  constexpr int kRow = 60, kColumn = 70;
  std::vector<float> light = Uniform(m, 0);
  // 10 full wells, and 2 in the pixel above.
  light[kRow * m.width + kColumn] = static_cast<float>(10 * full / 1000);
  light[(kRow - 1) * m.width + kColumn] = static_cast<float>(2 * full / 1000);
  const auto frame = Sensor(m, kSeed).Expose(light, 1, 0, 1, 0);
  const double q = std::exp(-1.0 / 3);
  for (int row = 0; row < m.height; ++row)
    for (int column = 0; column < m.width; ++column) {
      double electrons = light[row * m.width + column] * 1000.0;
      for (const auto& [from, over] : {std::pair(kRow, 9 * full), std::pair(kRow - 1, full)})
        if (column == kColumn && row != from)
          electrons += 0.5 * 0.4 * over * (1 - q) * std::pow(q, std::abs(row - from) - 1);
      EXPECT_NEAR(frame.value[row * m.width + column],
                  std::min(m.black_dn + m.gain_dn_per_e * electrons, m.saturation_dn), 2e-3)
          << row << ", " << column;
    }
}

}  // namespace
}  // namespace luxfield::hal::sim
