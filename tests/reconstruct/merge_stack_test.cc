// Merging pictures through a response: bias and spread against known radiance, what is flagged, and
// exposures found from the pictures.
#include "luxfield/reconstruct/calibrate/response/merge_stack.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/reconstruct/calibrate/response/calibrate_response.h"
#include "luxfield/reconstruct/calibrate/response/exif.h"
#include "test_camera.h"

namespace luxfield::reconstruct {
namespace {

namespace fs = std::filesystem;

// The camera's own curve and noise, to judge the merge without a calibration's errors.
ResponseCurve TrueCurve(const TestCamera& camera) {
  ResponseCurve curve;
  curve.saturation_code = camera.full_code();
  curve.reference_code = std::ceil(camera.full_code() / 2);
  for (const double z : CurveNodes(curve.saturation_code, curve.reference_code, 254)) {
    const double share = camera.expose(z / camera.full_code());
    const double electrons = share * camera.full_e;
    if (z < 25.0 / 255 * camera.full_code() || z > 250.0 / 255 * camera.full_code()) continue;
    curve.code.push_back(z);
    curve.log_exposure.push_back(camera.LogExposure(z, curve.reference_code));
    curve.sigma.push_back(0);
    // Rounding: one code, as a share of the exposure.
    const double step = std::log(camera.expose((z + 0.5) / camera.full_code()) /
                                 camera.expose((z - 0.5) / camera.full_code()));
    curve.noise_code.push_back(z);
    curve.noise.push_back(std::sqrt((electrons + camera.read_noise_e * camera.read_noise_e) /
                                        (electrons * electrons) +
                                    step * step / 12));
  }
  return curve;
}

const std::vector<double> kExposures = {0.02, 0.08, 0.3, 1.1};

struct Judged {
  double bias = 0, bias_error = 0, chi_squared = 0;
  int unknown = 0;
};

Judged Judge(const MergedPicture& merged, const std::vector<double>& radiance, double unit) {
  Judged judged;
  double sum = 0, squares = 0, chi = 0, count = 0;
  for (std::size_t p = 0; p < radiance.size(); ++p) {
    if (merged.mask[p]) {
      ++judged.unknown;
      continue;
    }
    const double error = merged.radiance.data[p] * unit / radiance[p] - 1;
    const double z = (merged.radiance.data[p] * unit - radiance[p]) / (merged.sigma.data[p] * unit);
    sum += error;
    squares += error * error;
    chi += z * z;
    ++count;
  }
  judged.bias = sum / count;
  judged.bias_error = std::sqrt(squares / count / count);
  judged.chi_squared = chi / count;
  return judged;
}

TEST(MergeStack, IsUnbiasedAndStatesItsSpread) {
  for (const int bits : {8, 16}) {
    TestCamera camera = CurvedCamera(7);
    camera.bits = bits;
    const auto scene = TestScene(640, 320, 0.05, 2.3);
    const PictureStack stack = TakeStack(camera, scene, 640, kExposures);
    const ResponseCurve curve = TrueCurve(camera);
    const MergedPicture merged = MergeStack(stack, std::span(&curve, 1));
    const double unit = camera.expose(curve.reference_code / camera.full_code());
    const Judged judged = Judge(merged, scene, unit);
    std::cout << fmt::format(
        "{} bit: bias {:+.5f} % +- {:.5f} %, chi^2 {:.4f} a pixel, {} of {} flagged (seed 7)\n",
        bits, 100 * judged.bias, 100 * judged.bias_error, judged.chi_squared, judged.unknown,
        scene.size());
    EXPECT_LT(judged.unknown, 0.02 * static_cast<double>(scene.size()));
    EXPECT_LT(std::abs(judged.bias), 4 * judged.bias_error + 1e-4);
    EXPECT_NEAR(judged.chi_squared, 1, 0.03);
  }
}

TEST(MergeStack, CalibratedAndMergedAgreeWithTheTruthWithinSigma) {
  const TestCamera camera = CurvedCamera(11);
  const auto scene = TestScene(240, 160, 2e-3, 4.5);
  const std::vector<double> exposures = {0.01, 0.03, 0.1, 0.25, 1, 3.5};
  const PictureStack stack = TakeStack(camera, scene, 240, exposures);
  CalibrateResponseOptions options;
  options.samples = 4000;
  const auto calibration = CalibrateResponse(stack, options);
  const auto curves = calibration.curves();
  const MergedPicture merged = MergeStack(stack, curves);
  const Judged judged =
      Judge(merged, scene, camera.expose(curves[0].reference_code / camera.full_code()));
  std::cout << fmt::format("calibrated: bias {:+.4f} %, chi^2 {:.3f} a pixel (seed 11)\n",
                           100 * judged.bias, judged.chi_squared);
  EXPECT_LT(std::abs(judged.bias), 5e-3);  // the reference node's own error is 0.1 to 0.2 %
  EXPECT_NEAR(judged.chi_squared, 1, 0.25);
}

TEST(MergeStack, SaturatedAndDarkAreFlaggedAndHoldWhatIsKnown) {
  const TestCamera camera = CurvedCamera(3);
  const ResponseCurve curve = TrueCurve(camera);
  const double unit = camera.expose(curve.reference_code / camera.full_code());
  for (const double radiance : {1e-9, 1e9}) {
    const std::vector<double> scene(100, radiance);
    const auto merged = MergeStack(TakeStack(camera, scene, 10, kExposures), std::span(&curve, 1));
    for (std::size_t p = 0; p < scene.size(); ++p) {
      const double value = merged.radiance.data[p] * unit, sigma = merged.sigma.data[p] * unit;
      if (radiance < 1) {
        EXPECT_EQ(merged.mask[p], lightfield::kTooDark);
        // The curve's lower end at the longest exposure.
        const double range = camera.expose(curve.low_code() / camera.full_code()) / 1.1;
        EXPECT_GE(value, 0);
        EXPECT_LT(value, range);
        EXPECT_GE(sigma, 0.99 * range / std::sqrt(12));
        EXPECT_LE(sigma, 1.01 * range);
      } else {
        EXPECT_EQ(merged.mask[p], lightfield::kSaturated);
        // What saturates the shortest, or a little less: its last codes are not calibrated.
        EXPECT_GT(value, 0.8 / 0.02);
        EXPECT_LT(value, 1.2 / 0.02);
        EXPECT_EQ(sigma, value);
      }
    }
    EXPECT_EQ(merged.figures[0].too_dark + merged.figures[0].saturated, 100);
  }
  // A saturated pixel blooms into its neighbours.
  std::vector<double> scene(100, 1e-2);
  scene[44] = 1e9;
  const auto merged = MergeStack(TakeStack(camera, scene, 10, {1, 3}), std::span(&curve, 1));
  for (const std::size_t p : {33, 34, 35, 43, 44, 45, 53, 54, 55})
    EXPECT_EQ(merged.mask[p], lightfield::kSaturated) << p;
  EXPECT_EQ(merged.mask[46], 0u);
  EXPECT_EQ(merged.figures[0].saturated, 9);
}

// Codes between the curve's end and saturation, many standard deviations above the former.
TEST(MergeStack, BeyondTheCurvesEndSigmaIsFinite) {
  const TestCamera camera = CurvedCamera(3);
  ResponseCurve curve = TrueCurve(camera);
  const std::vector<double> scene(100, camera.expose(0.985) / 0.02);
  const auto shorten = [&curve] {
    for (auto* values : {&curve.code, &curve.log_exposure, &curve.sigma}) values->pop_back();
  };
  while (curve.code.back() > 230) shorten();  // code 251 is that far above it
  while (curve.code.back() > 128) {
    const auto merged = MergeStack(TakeStack(camera, scene, 10, kExposures), std::span(&curve, 1));
    for (std::size_t p = 0; p < scene.size(); ++p) {
      ASSERT_EQ(merged.mask[p], lightfield::kSaturated) << "curve to code " << curve.code.back();
      ASSERT_GT(merged.radiance.data[p], 0);
      ASSERT_TRUE(std::isfinite(merged.sigma.data[p])) << "curve to code " << curve.code.back();
      ASSERT_GT(merged.sigma.data[p], 0);
    }
    shorten();
  }
}

// Like scans of film: 5 % of noise at best, 15 % and more at either end of the curve, and codes
// that never fall below a fog.
TestCamera GrainyCamera(std::uint64_t seed) {
  constexpr double kFog = 0.12;
  TestCamera camera = CurvedCamera(seed);
  camera.full_e = 400;
  camera.read_noise_e = 4;
  camera.develop = [curved = camera.develop](double x) { return kFog + (1 - kFog) * curved(x); };
  camera.expose = [curved = camera.expose](double v) {
    return curved(std::max(v - kFog, 1e-3) / (1 - kFog));
  };
  return camera;
}

// The codes whose noise is at most 15 %.
ResponseCurve GrainyCurve(const TestCamera& camera) {
  ResponseCurve curve;
  curve.saturation_code = camera.full_code();
  curve.reference_code = 128;
  for (double z = 50; z <= 245; ++z) {
    const double electrons = camera.expose(z / camera.full_code()) * camera.full_e,
                 noise =
                     std::sqrt(electrons + camera.read_noise_e * camera.read_noise_e) / electrons;
    if (noise > 0.15) continue;
    curve.code.push_back(z);
    curve.log_exposure.push_back(camera.LogExposure(z, curve.reference_code));
    curve.sigma.push_back(0);
    curve.noise_code.push_back(z);
    curve.noise.push_back(noise);
  }
  return curve;
}

// Eleven pictures a stop apart: four standard deviations at both ends of the curve leave less than
// a stop of it, and the shortest show a dark place as fog, hundreds of times too bright.
TEST(MergeStack, GrainyPicturesAreUsedToTheEndsOfTheCurve) {
  const TestCamera camera = GrainyCamera(5);
  const ResponseCurve curve = GrainyCurve(camera);
  std::vector<double> exposures;
  for (int k = 0; k <= 10; ++k) exposures.push_back(std::exp2(k - 10));
  const double low = camera.expose(curve.low_code() / camera.full_code());
  // From twice what the longest picture shows at the curve's end to half of the shortest's.
  const double least = 2 * low, most = 0.4 * 1024;
  const int width = 400, height = 200;
  const auto scene = TestScene(width, height, least, std::log10(most / least));
  const auto merged = MergeStack(TakeStack(camera, scene, width, exposures), std::span(&curve, 1));
  const Judged judged =
      Judge(merged, scene, camera.expose(curve.reference_code / camera.full_code()));
  std::cout << fmt::format(
      "codes {} to {}: bias {:+.4f} % +- {:.4f} %, chi^2 {:.4f} a pixel, {} of {} flagged, chi^2 "
      "of the samples {:.4f} a degree (seed 5)\n",
      curve.low_code(), curve.high_code(), 100 * judged.bias, 100 * judged.bias_error,
      judged.chi_squared, judged.unknown, scene.size(),
      merged.figures[0].chi_squared / merged.figures[0].degrees);
  EXPECT_LT(judged.unknown, 1e-3 * static_cast<double>(scene.size()));
  // Rounding to 8 bits and the curve's chords between codes move exposures by some 1e-4.
  EXPECT_LT(std::abs(judged.bias), 4 * judged.bias_error + 2e-4);
  EXPECT_NEAR(judged.chi_squared, 1, 0.05);
  EXPECT_NEAR(merged.figures[0].chi_squared / merged.figures[0].degrees, 1, 0.05);
}

// Darker than the longest picture can tell, and up to where it can: values go on without a step
// where the flag ends, and sigma holds the error.
TEST(MergeStack, DarkPixelsKeepTheirOrderBelowTheCurve) {
  const TestCamera camera = GrainyCamera(6);
  const ResponseCurve curve = GrainyCurve(camera);
  const double low = camera.expose(curve.low_code() / camera.full_code()),
               unit = camera.expose(curve.reference_code / camera.full_code());
  const int width = 60, height = 400;
  std::vector<double> scene;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      scene.push_back(low * std::exp2((column - 29.5) / 10));  // +- 3 stops
  const auto merged =
      MergeStack(TakeStack(camera, scene, width, {0.25, 0.5, 1}), std::span(&curve, 1));
  double last = 0;
  for (int column = 0; column < width; column += 5) {
    double sum = 0, squares = 0, flagged = 0;
    const double truth = scene[column];
    for (int row = 0; row < height; ++row) {
      const std::size_t p = static_cast<std::size_t>(row) * width + column;
      sum += merged.radiance.data[p] * unit / height;
      squares +=
          std::pow((merged.radiance.data[p] * unit - truth) / (merged.sigma.data[p] * unit), 2) /
          height;
      flagged += merged.mask[p] == lightfield::kTooDark;
    }
    std::cout << fmt::format("{:.3f} of the curve's end: mean {:.3f}, chi^2 {:.3f}, flagged {}\n",
                             truth / low, sum / low, squares, flagged / height);
    EXPECT_GT(sum, last);
    last = sum;
    EXPECT_LT(squares, 1 + 4 * std::sqrt(2.0 / height));
    if (truth < low / 2) {
      EXPECT_EQ(flagged, height);
    }
    if (truth > 2 * low) {
      EXPECT_EQ(flagged, 0);
    }
  }
}

// What moved between two pictures has an error bar that says so.
TEST(MergeStack, SamplesThatContradictOneAnotherWidenSigma) {
  const TestCamera camera = CurvedCamera(9);
  const ResponseCurve curve = TrueCurve(camera);
  std::vector<double> scene(400, 0.5);
  PictureStack stack = TakeStack(camera, scene, 20, {0.3, 0.6, 1.1});
  const auto still = MergeStack(stack, std::span(&curve, 1));
  for (std::size_t p = 200; p < scene.size(); ++p) scene[p] = 0.4;
  stack.pictures[1].code = TakeStack(camera, scene, 20, {0.6}).pictures[0].code;
  const auto moved = MergeStack(stack, std::span(&curve, 1));
  EXPECT_EQ(moved.sigma.data[50], still.sigma.data[50]);
  EXPECT_GT(moved.sigma.data[350], 4 * still.sigma.data[350]);
}

TEST(ExposureRatios, FindExposuresThatTheCameraMisstates) {
  // Chi-squared of the ratios over cameras; the true times differ from the stated by up to 8 %.
  constexpr int kSeeds = 20;
  const std::vector<double> truth = {0.93, 1.05, 0.98, 1};
  double chi_squared = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const TestCamera camera = CurvedCamera(seed);
    const ResponseCurve curve = TrueCurve(camera);
    std::vector<double> real = kExposures;
    for (std::size_t j = 0; j < real.size(); ++j) real[j] *= truth[j];
    PictureStack stack = TakeStack(camera, TestScene(160, 80, 0.05, 2.3), 160, real);
    for (std::size_t j = 0; j < real.size(); ++j) stack.pictures[j].exposure_s = kExposures[j];
    const auto result = EstimateExposures(stack, std::span(&curve, 1));
    for (std::size_t j = 0; j + 1 < truth.size(); ++j) {
      ASSERT_TRUE(result.known[j]);
      const double z = (result.ratio[j].value - truth[j]) / result.ratio[j].sigma;
      EXPECT_LT(std::abs(z), 5) << "seed " << seed << ", exposure " << j << ": "
                                << result.ratio[j].value << " +- " << result.ratio[j].sigma;
      chi_squared += z * z;
    }
    EXPECT_EQ(result.ratio[3].value, 1);
  }
  std::cout << fmt::format("chi^2 of the ratios {:.3f} (seeds 1 to {})\n",
                           chi_squared / (3 * kSeeds), kSeeds);
  EXPECT_NEAR(chi_squared / (3 * kSeeds), 1, 4 * std::sqrt(2.0 / (3 * kSeeds)));
}

TEST(ExposureRatios, SayWhichRungsNothingLinks) {
  ExposureRatios ratios(3);
  for (int p = 0; p < 10; ++p) {
    const std::vector<RungSample> pixel = {{0, 1.0 + p, 0.01}, {2, 1.1 * (1.0 + p), 0.01}};
    ratios.Add(pixel);
  }
  const auto result = ratios.Solve(2);
  EXPECT_TRUE(result.known[0]);
  EXPECT_FALSE(result.known[1]);
  EXPECT_EQ(result.ratio[1].value, 1);
  EXPECT_NEAR(result.ratio[0].value, 1 / 1.1, 1e-6);
}

TEST(ResponseFile, ReadsWhatItWroteAndNamesWhatIsWrong) {
  const TestCamera camera = CurvedCamera(3);
  ResponseCalibration calibration;
  calibration.channels.resize(1);
  calibration.channels[0].curve = TrueCurve(camera);
  const fs::path path = fs::path(testing::TempDir()) / "luxfield_response.cal.json";
  WriteResponseCalibration(path, calibration);
  const StoredResponse stored = ReadResponseCalibration(path);
  ASSERT_EQ(stored.curves.size(), 1u);
  EXPECT_EQ(stored.curves[0].code, calibration.channels[0].curve.code);
  EXPECT_EQ(stored.curves[0].log_exposure, calibration.channels[0].curve.log_exposure);
  std::swap(calibration.channels[0].curve.log_exposure[3],
            calibration.channels[0].curve.log_exposure[4]);
  WriteResponseCalibration(path, calibration);
  try {
    ReadResponseCalibration(path);
    FAIL() << "log_exposure falls";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("log_exposure"), std::string::npos) << error.what();
  }
  fs::remove(path);
}

TEST(PictureStack, ReadsPlanesInOrderAndRefusesMixtures) {
  const fs::path folder = fs::path(testing::TempDir()) / "luxfield_picture_stack";
  fs::create_directories(folder);
  const auto file = [&](const char* name) { return folder / name; };
  cv::Mat colour(2, 3, CV_16UC3, cv::Scalar(1000, 20000, 60000));  // B, G, R
  cv::imwrite(file("a.png").string(), colour);
  cv::imwrite(file("b.tiff").string(), colour);
  cv::imwrite(file("c.png").string(), cv::Mat(2, 3, CV_8UC1, cv::Scalar(7)));
  const std::vector<fs::path> good = {file("b.tiff"), file("a.png")},
                              mixed = {file("a.png"), file("c.png")};
  const std::vector<double> times = {2, 1};
  const PictureStack stack = ReadPictureStack(good, times);
  EXPECT_EQ(stack.bits, 16);
  EXPECT_EQ(stack.channels, 3);
  EXPECT_EQ(stack.pictures[0].exposure_s, 1);
  EXPECT_EQ(stack.plane(0, 0)[5], 60000);
  EXPECT_EQ(stack.plane(1, 2)[0], 1000);
  EXPECT_THROW(ReadPictureStack(mixed, times), InputError);
  EXPECT_THROW(ReadPictureStack(good, {}), InputError);  // no Exif
  EXPECT_THROW(ReadPictureStack(good, std::vector<double>{1, 1}), InputError);
  EXPECT_THROW(ReadPictureStack(std::span(good).first(1), std::vector<double>{1}), InputError);
  fs::remove_all(folder);
}

// A big-endian TIFF head with one directory that points to an Exif directory of ExposureTime 1/8.
std::string ExifBytes() {
  const unsigned char bytes[] = {'M', 'M', 0,    42,   0, 0, 0, 8,                     // head
                                 0,   1,   0x87, 0x69, 0, 4, 0, 0, 0, 1, 0, 0, 0, 26,  // IFD 0
                                 0,   0,   0,    0,                                    // no more
                                 0,   1,   0x82, 0x9A, 0, 5, 0, 0, 0, 1, 0, 0, 0, 44,  // Exif
                                 0,   0,   0,    0,    0, 0, 0, 1, 0, 0, 0, 8};
  return {reinterpret_cast<const char*>(bytes), sizeof(bytes)};
}

TEST(Exif, ReadsTheExposureTimeAndSurvivesEveryCut) {
  const std::string tiff = ExifBytes();
  ASSERT_TRUE(ReadExif(tiff).exposure_s);
  EXPECT_EQ(*ReadExif(tiff).exposure_s, 0.125);
  std::string jpeg = "\xFF\xD8\xFF\xE1";
  jpeg += '\0';
  jpeg += static_cast<char>(tiff.size() + 8);
  jpeg += std::string("Exif\0\0", 6) + tiff + "\xFF\xDA";
  EXPECT_EQ(ReadExif(jpeg).exposure_s, 0.125);
  for (const std::string& file : {tiff, jpeg})
    for (std::size_t size = 0; size < file.size(); ++size) {
      ReadExif(std::string_view(file).substr(0, size));
      for (const char byte : {'\0', '\xFF'}) {
        std::string damaged = file;
        damaged[size] = byte;
        ReadExif(damaged);
      }
    }
}

}  // namespace
}  // namespace luxfield::reconstruct
