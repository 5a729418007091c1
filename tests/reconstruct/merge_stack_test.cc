// Merging pictures through a response: bias and spread against known radiance, what is flagged, and
// exposures found from the pictures.
#include "reconstruct/merge_stack.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "core/error.h"
#include "core/exr.h"
#include "core/file.h"
#include "lightfield/measurements.h"
#include "reconstruct/calibrate_response.h"
#include "reconstruct/exif.h"
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
      EXPECT_EQ(merged.radiance.data[p], 0);
      EXPECT_EQ(merged.sigma.data[p], 0);
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

TEST(MergeStack, SaturatedAndDarkAreFlaggedNeverANumber) {
  const TestCamera camera = CurvedCamera(3);
  const ResponseCurve curve = TrueCurve(camera);
  for (const double radiance : {1e-9, 1e9}) {
    const std::vector<double> scene(100, radiance);
    const auto merged = MergeStack(TakeStack(camera, scene, 10, kExposures), std::span(&curve, 1));
    for (std::size_t p = 0; p < scene.size(); ++p) {
      EXPECT_EQ(merged.mask[p], radiance < 1 ? lightfield::kTooDark : lightfield::kSaturated);
      EXPECT_EQ(merged.radiance.data[p], 0);
      EXPECT_EQ(merged.sigma.data[p], 0);
    }
  }
  // A saturated pixel blooms into its neighbours.
  std::vector<double> scene(100, 1e-2);
  scene[44] = 1e9;
  const auto merged = MergeStack(TakeStack(camera, scene, 10, {1, 3}), std::span(&curve, 1));
  for (const std::size_t p : {33, 34, 35, 43, 44, 45, 53, 54, 55})
    EXPECT_EQ(merged.mask[p], lightfield::kSaturated) << p;
  EXPECT_EQ(merged.mask[46], 0u);
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
