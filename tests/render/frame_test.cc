// Means of frames and scaled light groups, from numbers made by hand.
#include "luxfield/render/film/frame.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "luxfield/render/film/light_groups.h"

namespace luxfield::render {
namespace {

core::Image Plain(int channels, double value) {
  core::Image image(2, 2, channels);
  std::fill(image.data.begin(), image.data.end(), static_cast<float>(value));
  return image;
}

LightGroup Group(const std::string& name, double value) {
  return {name, Plain(3, value), Plain(3, 10 * value), Plain(1, value * value)};
}

// A frame that is the sum of two lights.
Frame Lit(double first, double second) {
  Frame frame;
  frame.width = frame.height = 2;
  frame.groups = {Group("a", first), Group("b", second)};
  frame.radiance = Plain(3, first + second);
  frame.irradiance = Plain(3, 10 * (first + second));
  frame.variance = frame.stated_variance = Plain(1, first * first + second * second);
  frame.samples = Plain(1, 5);
  frame.lights = {{first, first * first}, {second, second * second}};
  return frame;
}

// m = (3 x + y) / 4 and v = (9 v_x + v_y) / 16, of the picture, of each light and of each group.
TEST(MeanFrame, WeighsThePictureItsLightsAndItsGroups) {
  const Frame mean = MeanFrame(Lit(8, 4), 3, Lit(16, 0), 1);
  EXPECT_FLOAT_EQ(mean.radiance.data[0], 13);
  EXPECT_FLOAT_EQ(mean.irradiance.data[0], 130);
  EXPECT_FLOAT_EQ(mean.variance.data[0], (9 * 80 + 256) / 16.0f);
  EXPECT_FLOAT_EQ(mean.samples.data[0], 10);
  EXPECT_DOUBLE_EQ(mean.lights[0].mean_luminance, 10);
  EXPECT_DOUBLE_EQ(mean.lights[1].mean_luminance, 3);
  EXPECT_DOUBLE_EQ(mean.lights[0].mean_variance, (9 * 64 + 256) / 16.0);
  EXPECT_DOUBLE_EQ(mean.lights[1].mean_variance, 9);
  ASSERT_EQ(mean.groups.size(), 2u);
  EXPECT_FLOAT_EQ(mean.groups[0].radiance.data[0], 10);
  EXPECT_FLOAT_EQ(mean.groups[1].radiance.data[0], 3);
  EXPECT_FLOAT_EQ(mean.groups[0].irradiance.data[0], 100);
  EXPECT_FLOAT_EQ(mean.groups[0].variance.data[0], (9 * 64 + 256) / 16.0f);
  EXPECT_FLOAT_EQ(mean.groups[1].variance.data[0], 9);
}

TEST(ScaleLightGroups, ScalesVariancesByTheSquare) {
  const Frame scaled = ScaleLightGroups(Lit(8, 4), {{"a", 0.5}, {"b", 3}}, "x.exr");
  EXPECT_FLOAT_EQ(scaled.radiance.data[0], 4 + 12);
  EXPECT_FLOAT_EQ(scaled.irradiance.data[0], 160);
  EXPECT_FLOAT_EQ(scaled.variance.data[0], 64 / 4.0f + 9 * 16);
  EXPECT_FLOAT_EQ(scaled.groups[1].variance.data[0], 144);
}

}  // namespace
}  // namespace luxfield::render
