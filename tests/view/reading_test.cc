// What a picture says at a pixel.
#include "luxfield/view/picture/reading.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/view/picture/read_picture.h"

namespace luxfield::view {
namespace {

render::Frame TwoPixels() {
  render::Frame frame;
  frame.width = 2;
  frame.height = 1;
  frame.unit = lightfield::FluxUnit::kLumen;
  for (core::Image* image : {&frame.radiance, &frame.irradiance, &frame.position})
    *image = core::Image(2, 1, 3);
  frame.coverage = frame.variance = core::Image(2, 1, 1);
  // Y = 0.2126 R + 0.7152 G + 0.0722 B.
  frame.radiance.data = {1, 10, 1, 10, 1, 10};
  frame.irradiance.data = {0, 100, 0, 200, 0, 300};
  frame.position.data = {0, 1, 0, 2, 0, 3};
  frame.coverage.data = {0, 1};
  frame.variance.data = {0, 0.25};
  return frame;
}

TEST(Reading, SaysWhatThePixelHolds) {
  const auto reading = ReadAt(TwoPixels(), 1, 0);
  ASSERT_TRUE(reading);
  EXPECT_NEAR(reading->luminance, 10, 1e-3);
  EXPECT_NEAR(reading->illuminance.value(), 21.26 + 143.04 + 21.66, 0.1);
  EXPECT_DOUBLE_EQ(reading->luminance_sigma.value(), 0.5);
  EXPECT_DOUBLE_EQ(reading->position.value().z, 3);
  EXPECT_EQ(
      Describe(*reading, lightfield::FluxUnit::kLumen),
      "(1, 0)  10.00 +- 0.50 cd/m2  186.0 +- 9.3 lx (direct light only)  at 1.000 2.000 3.000 m");
  Reading measured = *reading;
  measured.measured_rel_sigma = 0.0123;
  EXPECT_THAT(Describe(measured, lightfield::FluxUnit::kLumen),
              testing::HasSubstr("(direct light only)  measured to 1.2 %  at"));
}

TEST(Reading, ShowsAsManyDigitsAsAreKnown) {
  EXPECT_EQ(WithSigma(2.44796, 0.00031), "2.44796 +- 0.00031");
  EXPECT_EQ(WithSigma(123456.7, 1234), "123500 +- 1200");
  EXPECT_EQ(WithSigma(2.44796, {}), "2.448");
  EXPECT_EQ(WithSigma(2.44796, 0), "2.448");
}

// In a penumbra the few samples of most pixels agree, and state no error; their neighbours do.
TEST(Reading, TakesItsSigmaFromThePixelsAround) {
  render::Frame frame;
  frame.width = frame.height = 5;
  frame.radiance = core::Image(5, 5, 3);
  frame.coverage = frame.variance = frame.samples = core::Image(5, 5, 1);
  frame.coverage.data.assign(25, 1);
  frame.samples.data.assign(25, 4);
  frame.samples.at(0, 2, 2) = 16;
  frame.variance.at(0, 1, 3) = 0.36f;
  frame.variance.at(0, 4, 4) = 100;  // too far away
  EXPECT_NEAR(ReadAt(frame, 2, 2)->luminance_sigma.value(), std::sqrt(0.36 * 4 / 9 / 16), 1e-6);
  // At the border there are fewer of them, and pixels that took no samples do not count.
  EXPECT_NEAR(ReadAt(frame, 4, 0)->luminance_sigma.value(), std::sqrt(0.36 / 4), 1e-6);
  frame.samples.at(0, 0, 3) = 0;
  EXPECT_NEAR(ReadAt(frame, 4, 0)->luminance_sigma.value(), std::sqrt(0.36 / 3), 1e-6);
  EXPECT_EQ(ReadAt(frame, 0, 0)->luminance_sigma.value(), 0);
  frame.samples = {};  // of another program
  EXPECT_NEAR(ReadAt(frame, 3, 1)->luminance_sigma.value(), 0.6, 1e-6);
}

TEST(Reading, WhereNothingWasHitThereIsNoIrradianceAndNoPlace) {
  const auto reading = ReadAt(TwoPixels(), 0, 0);
  ASSERT_TRUE(reading);
  EXPECT_FALSE(reading->illuminance);
  EXPECT_FALSE(reading->position);
  EXPECT_EQ(Describe(*reading, lightfield::FluxUnit::kWatt), "(0, 0)  1 W/(sr m2)");
}

TEST(Reading, OutsideOfThePictureIsNothing) {
  for (const auto& [column, row] :
       {std::pair{-1, 0}, std::pair{2, 0}, std::pair{0, -1}, std::pair{0, 1}})
    EXPECT_FALSE(ReadAt(TwoPixels(), column, row)) << column << " " << row;
}

TEST(Reading, APictureOfRadianceAloneSaysNoMore) {
  render::Frame frame = TwoPixels();
  frame.irradiance = frame.position = frame.coverage = frame.variance = {};
  const auto reading = ReadAt(frame, 1, 0);
  ASSERT_TRUE(reading);
  EXPECT_FALSE(reading->illuminance || reading->luminance_sigma || reading->position);
}

}  // namespace
}  // namespace luxfield::view
