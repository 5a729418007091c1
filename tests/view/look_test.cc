// Colours on the screen are those that `render` writes into its PNGs.
#include "luxfield/view/picture/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/random.h"
#include "luxfield/view/picture/tone_codes.h"
#include "tests/seed.h"

namespace luxfield::view {
namespace {

// Values over eight decades, some of them negative or 0.
render::Frame RandomFrame(int width, int height) {
  render::Frame frame;
  frame.width = width;
  frame.height = height;
  frame.radiance = core::Image(width, height, 3);
  frame.irradiance = core::Image(width, height, 3);
  core::Random random(TestSeed(3), 0);
  for (core::Image* image : {&frame.radiance, &frame.irradiance})
    for (float& value : image->data) {
      const double kind = random.Uniform();
      const double size = std::pow(10, 8 * random.Uniform() - 4);
      value = static_cast<float>(kind < 0.05 ? 0 : kind < 0.1 ? -size : size);
    }
  return frame;
}

std::vector<std::uint8_t> WithoutAlpha(const std::vector<std::uint8_t>& rgba) {
  std::vector<std::uint8_t> rgb;
  for (std::size_t i = 0; i < rgba.size(); ++i)
    if (i % 4 != 3) rgb.push_back(rgba[i]);
  return rgb;
}

// The left `width` columns.
std::vector<std::uint8_t> BytesOfPng(const std::filesystem::path& path, int width, int height) {
  const cv::Mat image = cv::imread(path.string(), cv::IMREAD_COLOR);
  std::vector<std::uint8_t> rgb;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      for (int c = 2; c >= 0; --c) rgb.push_back(image.at<cv::Vec3b>(row, column)[c]);
  return rgb;
}

std::filesystem::path Temporary(const char* name) {
  return std::filesystem::path(testing::TempDir()) /
         ("luxfield_look_" + std::to_string(getpid()) + name);
}

TEST(Look, EncodesEveryValueAsTheFormulaRoundsIt) {
  core::Random random(TestSeed(4), 0);
  for (int i = 0; i < 300000; ++i) {
    const double x = static_cast<float>(i % 2 ? random.Uniform() : std::pow(random.Uniform(), 4));
    ASSERT_EQ(EncodeByte(x), std::lround(255 * core::SrgbEncode(x))) << x;
  }
  for (const double x : {-1.0, 0.0, 1.0, 2.0, 1e30})
    EXPECT_EQ(EncodeByte(x), std::lround(255 * core::SrgbEncode(x))) << x;
  EXPECT_EQ(EncodeByte(std::nan("")), 0);
}

// Codes of a table are those of the operator, at every code's edge and of values that are none.
TEST(ToneCodes, AreTheCodesOfTheCurve) {
  const auto code = [](float value) {
    return EncodeByte(
        static_cast<float>(core::ExponentialTone({value, value, value}, 1.3, 0.7)[0]));
  };
  const ToneCodes codes(code);
  core::Random random(TestSeed(5), 0);
  std::array<int, 256> seen{};
  for (int i = 0; i < 300000; ++i) {
    const auto value = static_cast<float>(std::pow(10, 8 * random.Uniform() - 6));
    ASSERT_EQ(codes.At(value), code(value)) << value;
    ++seen[codes.At(value)];
  }
  EXPECT_THAT(seen, testing::Each(testing::Gt(0)));
  for (const float value : {0.0f, -0.0f, -1.0f, -1e30f, std::nanf("")})
    EXPECT_EQ(codes.At(value), 0);
  EXPECT_EQ(codes.At(std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(codes.At(std::numeric_limits<float>::denorm_min()), 0);
  const ToneCodes black([](float) { return std::uint8_t{0}; });
  EXPECT_EQ(black.At(1e30f), 0);
}

TEST(Look, ToneOperatorsAreThoseOfTheWrittenPng) {
  const render::Frame frame = RandomFrame(40, 30);
  const auto path = Temporary(".png");
  render::WritePng(path, render::ToneMap(frame.radiance, {}));
  EXPECT_EQ(WithoutAlpha(ColoursOf(frame, {})), BytesOfPng(path, 40, 30));
  for (const auto& [name, curve] : render::ToneCurves()) {
    Look look;
    look.tone = ToneOf(curve);
    render::WritePng(path, render::ToneMap(frame.radiance, {.exposure = {}, .curve = curve}));
    EXPECT_EQ(WithoutAlpha(ColoursOf(frame, look)), BytesOfPng(path, 40, 30)) << name;
  }
  Look linear;
  linear.tone = Tone::kLinear;
  linear.exposure = 0.037;
  render::ToneMapping mapping;
  mapping.exposure = linear.exposure;
  render::WritePng(path, render::ToneMap(frame.radiance, mapping));
  EXPECT_EQ(WithoutAlpha(ColoursOf(frame, linear)), BytesOfPng(path, 40, 30));
  std::filesystem::remove(path);
}

TEST(Look, FalseColoursAreThoseOfTheWrittenMap) {
  const render::Frame frame = RandomFrame(200, 160);
  const auto path = Temporary("_map.png");
  Look look;
  look.tone = Tone::kFalseColour;
  render::WriteFalseColour(path, frame.radiance, "luminance", "cd/m2");
  EXPECT_EQ(WithoutAlpha(ColoursOf(frame, look)), BytesOfPng(path, 200, 160));
  look.layer = Layer::kIrradiance;
  look.scale = render::FalseColourScale{0.5, 300};
  render::WriteFalseColour(path, frame.irradiance, "illuminance", "lx", *look.scale);
  EXPECT_EQ(WithoutAlpha(ColoursOf(frame, look)), BytesOfPng(path, 200, 160));
  std::filesystem::remove(path);
}

TEST(Look, APictureWithoutIrradianceShowsItsRadiance) {
  render::Frame frame = RandomFrame(4, 4);
  frame.irradiance = {};
  Look look;
  look.tone = Tone::kFalseColour;
  look.layer = Layer::kIrradiance;
  EXPECT_EQ(ShownLayer(frame, look, {}), Layer::kRadiance);
}

}  // namespace
}  // namespace luxfield::view
