#include "luxfield/reconstruct/calibrate/glare/calibrate_glare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

constexpr int kWidth = 90, kHeight = 70;
constexpr double kColumn = 40, kRow = 30, kRadius_px = 15, kField = 1000;

// A disc of `veil` in a field of kField, with noise of `sigma`.
MergedFrame Picture(double veil, double sigma, std::uint64_t seed) {
  MergedFrame frame;
  frame.width = kWidth;
  frame.height = kHeight;
  const std::size_t pixels = kWidth * kHeight;
  frame.sigma_e_per_s.assign(pixels, static_cast<float>(sigma));
  frame.count.assign(pixels, 1);
  frame.mask.assign(pixels, 0);
  core::Random random(seed, 0);
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const bool trap = std::hypot(column + 0.5 - kColumn, row + 0.5 - kRow) < kRadius_px;
      frame.rate_e_per_s.push_back(
          static_cast<float>((trap ? 0 : kField) + veil + sigma * random.Normal()));
    }
  return frame;
}

double MeanOf(const MergedFrame& frame) {
  double sum = 0;
  for (const float rate : frame.rate_e_per_s) sum += rate;
  return sum / static_cast<double>(frame.rate_e_per_s.size());
}

TEST(CalibrateGlare, MeasuresTheVeilWithItsStandardError) {
  constexpr int kRuns = 100;
  constexpr double kVeil = 1.5;
  const double truth = kVeil / MeanOf(Picture(kVeil, 0, 0));
  double chi_squared = 0;
  for (int run = 0; run < kRuns; ++run) {
    const GlarePlace place = MeasureGlare(Picture(kVeil, 3, 100 + run), {1}, "picture");
    chi_squared += std::pow((place.share - truth) / place.share_sigma, 2);
    EXPECT_NEAR(place.column, kColumn, 1);
    EXPECT_NEAR(place.row, kRow, 1);
    EXPECT_NEAR(place.radius_px, 4.0 / 3 * kRadius_px, 1.5);
    EXPECT_GT(place.bound + 4 * place.bound_sigma, kVeil / (kField + kVeil));
  }
  // 100 degrees: 99.99 % lie between 53 and 163.
  EXPECT_GT(chi_squared, 53) << "seeds from 100 on";
  EXPECT_LT(chi_squared, 163) << "seeds from 100 on";
}

TEST(CalibrateGlare, VignettingAndHotPixelsDoNotChangeIt) {
  MergedFrame frame = Picture(2, 0, 0);
  const double share = MeasureGlare(frame, {1}, "picture").share;
  std::vector<float> sensitivity;
  for (int p = 0; p < kWidth * kHeight; ++p) {
    sensitivity.push_back(1 - 0.5f * static_cast<float>(p % kWidth) / kWidth);
    frame.rate_e_per_s[p] *= sensitivity.back();
  }
  const std::size_t hot = static_cast<std::size_t>(kRow) * kWidth + static_cast<int>(kColumn);
  frame.rate_e_per_s[hot] = 1e6;
  frame.mask[hot] = lightfield::kDefect;
  EXPECT_NEAR(MeasureGlare(frame, sensitivity, "picture").share / share, 1, 1e-3);
}

TEST(CalibrateGlare, RefusesAPictureWithoutATrap) {
  const auto refusal = [](const MergedFrame& frame) {
    try {
      MeasureGlare(frame, {1}, "a.tif");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was refused");
  };
  MergedFrame even = Picture(0, 0, 0);
  even.rate_e_per_s.assign(even.rate_e_per_s.size(), 5);
  EXPECT_THAT(refusal(even), testing::HasSubstr("a.tif: shows no light trap"));
  even.rate_e_per_s[20 * kWidth + 20] = 0;
  EXPECT_THAT(refusal(even), testing::HasSubstr("core of 1 pixels"));
}

TEST(CalibrateGlare, FileIsReadBackForItsCameraOnly) {
  GlareCalibration calibration;
  calibration.width = kWidth;
  calibration.height = kHeight;
  calibration.share = 0.0012;
  calibration.share_sigma = 1e-5;
  calibration.bound = 0.002;
  calibration.radius_px = 10;
  const auto path = std::filesystem::path(testing::TempDir()) / "luxfield_glare.cal.json";
  WriteGlareCalibration(path, calibration);
  EXPECT_TRUE(IsGlareCalibration(path));
  rig::SensorModel sensor;
  sensor.width = kWidth;
  sensor.height = kHeight;
  const StatedGlare stated = ReadGlareCalibration(path, sensor);
  EXPECT_EQ(stated.share, 0.0012);
  EXPECT_EQ(stated.bound, 0.002);
  sensor.width = 91;
  EXPECT_THROW(ReadGlareCalibration(path, sensor), InputError);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace luxfield::reconstruct
