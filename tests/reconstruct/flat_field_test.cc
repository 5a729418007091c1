#include "luxfield/reconstruct/calibrate/sensor/flat_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 80;
constexpr double kBlack = 100, kGain = 0.5, kRead = 2;

// cos^4 of a lens whose centre lies beside the sensor's, times PRNU.
std::vector<double> Truth(double prnu, std::uint64_t seed) {
  std::vector<double> truth(static_cast<std::size_t>(kWidth) * kHeight);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const double x = (column + 0.5 - 52) / 90, y = (row + 0.5 - 38) / 90;
      const std::size_t k = static_cast<std::size_t>(row) * kWidth + column;
      const double noise = core::Random(seed, 1, static_cast<std::uint32_t>(k)).Normal();
      truth[k] = std::pow(1 + x * x + y * y, -2) * (1 + prnu * noise);
    }
  return truth;
}

session::RawFrame Frame(const std::vector<double>& truth, double electrons, std::uint64_t seed,
                        std::uint64_t stream) {
  session::RawFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  frame.dn.resize(frame.size());
  for (std::size_t k = 0; k < frame.size(); ++k) {
    core::Random random(seed, stream, static_cast<std::uint32_t>(k));
    const double e = random.Poisson(electrons * truth[k]);
    frame.dn[k] =
        static_cast<std::uint16_t>(std::lround(kBlack + kGain * e + kRead * random.Normal()));
  }
  return frame;
}

// Pairs of flats at three levels, the lamp drifting, and of darks.
std::vector<CalibrationPair> Pairs(const std::vector<double>& truth, int count, double full_e,
                                   std::uint64_t seed) {
  std::vector<CalibrationPair> pairs;
  for (int n = 0; n < count; ++n) {
    const double level = full_e * (0.3 + 0.2 * (n % 3)) * (1 + 0.01 * n);
    const auto stream = static_cast<std::uint64_t>(4 * n + 10);
    pairs.push_back({false, 0, 1.0, 0, 0, [=] {
                       return std::pair(Frame(truth, level, seed, stream),
                                        Frame(truth, 1.01 * level, seed, stream + 1));
                     }});
    pairs.push_back({true, 0, 1.0, 0, 0, [=] {
                       return std::pair(Frame(truth, 0, seed, stream + 2),
                                        Frame(truth, 0, seed, stream + 3));
                     }});
  }
  return pairs;
}

rig::SensorModel Sensor() {
  rig::SensorModel sensor;
  sensor.width = kWidth;
  sensor.height = kHeight;
  sensor.bits = 12;
  sensor.black_dn = kBlack;
  sensor.gain_dn_per_e = kGain;
  sensor.read_noise_dn = kRead;
  sensor.saturation_dn = 4000;
  return sensor;
}

int SiteOfPixel(std::size_t k) { return static_cast<int>(k / kWidth % 2 * 2 + k % kWidth % 2); }

// The map's scale against the truth (only relative sensitivity can be known), over all pixels or
// one site's, and its chi^2 per pixel with that scale.
struct Comparison {
  double scale = 0, chi_squared = 0;
};
Comparison Compare(const FlatField& field, const std::vector<double>& truth, int site = -1) {
  double above = 0, below = 0, pixels = 0;
  const auto counts = [&](std::size_t k) { return site < 0 || SiteOfPixel(k) == site; };
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (!counts(k)) continue;
    const double weight = 1 / (static_cast<double>(field.sigma[k]) * field.sigma[k]);
    above += weight * field.sensitivity[k] * truth[k];
    below += weight * truth[k] * truth[k];
    ++pixels;
  }
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (counts(k))
      sum += std::pow((field.sensitivity[k] - above / below * truth[k]) / field.sigma[k], 2);
  return {above / below, sum / (pixels - 1)};
}

double ChiSquared(const FlatField& field, const std::vector<double>& truth) {
  return Compare(field, truth).chi_squared;
}

TEST(FlatField, TakesTheMeasuredMapWherePatternIsAboveItsNoise) {
  const auto truth = Truth(0.01, 5);
  const FlatField field = MeasureFlatField(Pairs(truth, 12, 6000, 6), Sensor());
  EXPECT_TRUE(field.measured);
  EXPECT_EQ(field.flats, 24);
  const double pixels = static_cast<double>(truth.size());
  EXPECT_NEAR(field.pattern, 0.01, 4.5 * 0.011 / std::sqrt(2 * pixels));
  const double chi = ChiSquared(field, truth);
  std::cout << "measured: chi^2 per pixel " << chi << ", pattern " << field.pattern << "\n";
  EXPECT_NEAR(chi, 1, 4.5 * std::sqrt(2 / pixels));
}

TEST(FlatField, TakesThePolynomialWhereNoiseIsAbovePattern) {
  const auto truth = Truth(0.004, 7);
  const FlatField field = MeasureFlatField(Pairs(truth, 3, 6000, 8), Sensor());
  EXPECT_FALSE(field.measured);
  EXPECT_EQ(field.flats, 6);
  const double chi = ChiSquared(field, truth);
  std::cout << "polynomial: chi^2 per pixel " << chi << ", pattern " << field.pattern << ", degree "
            << field.degree << "\n";
  // The pattern's square is what is left of one five times as large, to some 7 %.
  EXPECT_NEAR(chi, 1, 0.35);
  // It is a share of the sensitivity, in the corners as in the middle.
  for (std::size_t k = 0; k < truth.size(); k += 79)
    EXPECT_NEAR(field.sigma[k] / (field.pattern * field.sensitivity[k]), 1, 1e-5) << k;
}

// Sensitivity is relative to the middle of the picture, where a slope shows a pixel beside it: 0.8 %.
TEST(FlatField, IsOneInTheMiddleOfASlope) {
  std::vector<double> slope;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      core::Random random(15, 1, static_cast<std::uint32_t>(slope.size()));
      slope.push_back((1 + 0.8 * ((column + 0.5) / kWidth - 0.5)) * (1 + 0.01 * random.Normal()));
    }
  const FlatField field = MeasureFlatField(Pairs(slope, 12, 6000, 16), Sensor());
  EXPECT_TRUE(field.measured);
  // A polynomial's middle is some three times as uncertain as a mean.
  EXPECT_NEAR(Compare(field, slope).scale, 1,
              4.5 * 3 * 0.011 / std::sqrt(static_cast<double>(slope.size())));
}

TEST(FlatField, EverySiteOfAMosaicHasItsOwnLevelAndShading) {
  // Level of each site, and how far its colour's shading is moved.
  constexpr std::array<double, 4> kLevel = {0.5, 1, 0.97, 0.7}, kMoved_px = {4, 0, 0, -3};
  auto truth = Truth(0.01, 11);
  std::vector<double> sensitivity(truth.size());  // 1 in the middle, but for PRNU
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const std::size_t column = k % kWidth, row = k / kWidth;
    const int site = SiteOfPixel(k);
    const auto shading = [&](double x_px, double y_px) {
      const double x = (x_px - 52) / 90, y = (y_px - 38) / 90;
      return std::pow(1 + x * x + y * y, -2);
    };
    const double x = static_cast<double>(column) + 0.5, y = static_cast<double>(row) + 0.5;
    truth[k] *= shading(x + kMoved_px[site], y) / shading(x, y);
    sensitivity[k] = truth[k] / shading(0.5 * kWidth + kMoved_px[site], 0.5 * kHeight);
    truth[k] *= kLevel[site];
  }
  rig::SensorModel sensor = Sensor();
  sensor.cfa = "RGGB";
  const FlatField field = MeasureFlatField(Pairs(truth, 12, 6000, 12), sensor);
  EXPECT_TRUE(field.measured);
  EXPECT_GE(field.flats, 16);  // red is too dark in the dimmest
  EXPECT_NEAR(field.pattern, 0.01,
              4.5 * 0.011 / std::sqrt(2.0 * static_cast<double>(truth.size())));
  const double pixels = 0.25 * static_cast<double>(truth.size());
  for (int site = 0; site < 4; ++site) {
    const Comparison c = Compare(field, sensitivity, site);
    std::cout << "site " << site << ": chi^2 per pixel " << c.chi_squared << ", scale " << c.scale
              << "\n";
    EXPECT_NEAR(c.chi_squared, 1, 4.5 * std::sqrt(2 / pixels));
    // A polynomial's middle is some three times as uncertain as a mean.
    EXPECT_NEAR(c.scale, 1, 4.5 * 3 * 0.011 / std::sqrt(pixels));
  }
  sensor.saturation_dn = 40000;
  EXPECT_THROW(MeasureFlatField(Pairs(truth, 1, 6000, 12), sensor), InputError);
}

TEST(FlatField, GoesThroughItsFileAndReplacesVignettingAndPrnu) {
  const auto truth = Truth(0.01, 9);
  const FlatField field = MeasureFlatField(Pairs(truth, 6, 6000, 10), Sensor());
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_test.flat.exr";
  WriteFlatField(path, field);
  rig::SensorModel sensor = Sensor();
  sensor.prnu = 0.01;
  EXPECT_EQ(ApplyFlatField(path, sensor).size(), 64u);
  EXPECT_EQ(sensor.vignetting, field.sensitivity);
  EXPECT_NEAR(sensor.prnu, field.noise, 0.01 * field.noise);
  rig::SensorModel other = Sensor();
  other.width = 97;
  EXPECT_THROW(ApplyFlatField(path, other), InputError);
}

TEST(FlatField, RefusesFlatsWithoutLight) {
  const auto truth = Truth(0, 1);
  try {
    MeasureFlatField(Pairs(truth, 2, 50, 2), Sensor());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no flat has a mean"));
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
