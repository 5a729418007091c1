// Layers, histograms, profiles and lines of equal value, of pictures whose values are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "luxfield/core/measures.h"
#include "luxfield/view/picture/histogram.h"
#include "luxfield/view/picture/look.h"
#include "luxfield/view/picture/profile.h"
#include "luxfield/view/picture/ticks.h"

namespace luxfield::view {
namespace {

// The radiance grows tenfold every 30 columns, from 1 on the left; in all channels alike.
render::Frame Ramp(int width, int height) {
  render::Frame frame;
  frame.width = width;
  frame.height = height;
  frame.unit = lightfield::FluxUnit::kLumen;
  frame.radiance = core::Image(width, height, 3);
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column)
        frame.radiance.at(c, row, column) = static_cast<float>(std::pow(10, column / 30.0));
  return frame;
}

TEST(Histogram, HasTheSharesOfItsPixels) {
  render::Frame frame = Ramp(91, 4);  // three decades
  for (int c = 0; c < 3; ++c) {
    frame.radiance.at(c, 0, 0) = 0;
    frame.radiance.at(c, 1, 0) = 0.009f;  // just below five decades
  }
  const Histogram histogram = HistogramOf(frame.radiance, 50);
  EXPECT_NEAR(histogram.max, 1000, 1e-3);
  EXPECT_NEAR(histogram.min, 0.01, 1e-6);
  EXPECT_NEAR(histogram.dark, 1.0 / 364, 1e-12);
  EXPECT_NEAR(histogram.median, std::pow(10, 1.5), std::pow(10, 1.5) * 0.04);
  double sum = 0;
  for (std::size_t i = 0; i < histogram.shares.size(); ++i) {
    sum += histogram.shares[i];
    // A bin is a tenth of a decade, three columns; the lowest two decades are empty.
    if (i < 20) {
      EXPECT_EQ(histogram.shares[i], 0);
    }
    if (i > 20 && i < 49) {
      EXPECT_NEAR(histogram.shares[i], 3.0 / 91, 1.01 / 91) << i;
    }
  }
  EXPECT_NEAR(histogram.below, 1.0 / 364, 1e-12);
  EXPECT_NEAR(sum, 1 - histogram.dark - histogram.below, 1e-6);
}

TEST(Histogram, OfADarkPictureIsEmpty) {
  const Histogram histogram = HistogramOf(core::Image(5, 4, 3));
  EXPECT_EQ(histogram.max, 0);
  EXPECT_EQ(histogram.dark, 1);
  EXPECT_THAT(histogram.shares, testing::Each(0));
}

// A letter is one wide.
std::vector<std::string> TextsAt(const render::FalseColourScale& scale, Layer layer, double width) {
  std::vector<std::string> texts;
  double free_from = 0;
  for (const TickText& text :
       TextsOf(TicksOf(scale, layer), width, 1,
               [](const std::string& label) { return static_cast<double>(label.size()); })) {
    EXPECT_GE(text.left, free_from) << text.text;
    free_from = text.left + static_cast<double>(text.text.size()) + 1;
    EXPECT_LE(free_from - 1, width + 1e-9);
    texts.push_back(text.text);
  }
  return texts;
}

// Either all of a decade's marks have labels, or only every decade, or every second one.
TEST(Ticks, AreLabelledEvenlyAsFarAsThereIsRoom) {
  const render::FalseColourScale decades{1, 1e4};
  EXPECT_THAT(TextsAt(decades, Layer::kRadiance, 200),
              testing::ElementsAre("1", "2", "5", "10", "20", "50", "100", "200", "500", "1000",
                                   "2000", "5000", "10000"));
  EXPECT_THAT(TextsAt(decades, Layer::kRadiance, 40),
              testing::ElementsAre("1", "10", "100", "1000", "10000"));
  EXPECT_THAT(TextsAt(decades, Layer::kRadiance, 18), testing::ElementsAre("1", "100", "10000"));
  EXPECT_THAT(TextsAt({0, 1}, Layer::kCoverage, 30),
              testing::ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1"));
  EXPECT_THAT(TextsAt({0, 1}, Layer::kCoverage, 10), testing::ElementsAre("0", "1"));
  // A scale without two of the marks.
  EXPECT_THAT(TextsAt({2.1, 4.9}, Layer::kRadiance, 40), testing::ElementsAre("2.1", "4.9"));
}

TEST(Ticks, StandWhereTheValueIs) {
  for (const Tick& tick : TicksOf({0.02, 5}, Layer::kRadiance))
    EXPECT_NEAR(0.02 * std::pow(5 / 0.02, tick.position), tick.value, 1e-9 * tick.value);
}

TEST(Saturated, IsTheShareOfPixelsWithAChannelAtItsLargest) {
  EXPECT_EQ(Saturated({0, 0, 255, 255, 254, 254, 254, 255, 255, 255, 255, 255, 0, 0, 0, 255}), 0.5);
  EXPECT_EQ(Saturated({}), 0);
}

TEST(Profile, IsWhatThePixelsSayFromEndToEnd) {
  const render::Frame frame = Ramp(91, 20);
  const auto profile = ProfileOf(frame, {10.5 / 91, 2.5 / 20}, {70.5 / 91, 17.5 / 20});
  ASSERT_EQ(profile.size(), 61);
  for (std::size_t i = 0; i < profile.size(); ++i) {
    EXPECT_EQ(profile[i].column, 10 + static_cast<int>(i));
    EXPECT_NEAR(profile[i].row, 2 + 15.0 * static_cast<double>(i) / 60, 1);
    EXPECT_NEAR(profile[i].luminance, std::pow(10, profile[i].column / 30.0), 1e-3);
  }
  EXPECT_EQ(profile.back().row, 17);
  EXPECT_EQ(ProfileOf(frame, {0.5, 0.1}, {0.5, 0.1}).size(), 1);
  EXPECT_TRUE(ProfileOf(frame, {0.5, 0.1}, {1.5, 0.1}).empty());
  // Backwards it is the same.
  const auto back = ProfileOf(frame, {70.5 / 91, 17.5 / 20}, {10.5 / 91, 2.5 / 20});
  ASSERT_EQ(back.size(), profile.size());
  EXPECT_EQ(back.front().luminance, profile.back().luminance);
}

TEST(Profile, IsCopiedAsATable) {
  Reading full, bare;
  full.column = 3;
  bare.column = full.row = bare.row = 4;
  full.luminance = 12.5;
  full.illuminance = 100.25;
  full.luminance_sigma = 0.5;
  full.position = {1, 2, 0.25};
  bare.luminance = 1;
  EXPECT_EQ(
      TableOf({full, bare}, lightfield::FluxUnit::kLumen),
      "column\trow\tluminance in cd/m2\tsigma in cd/m2\tdirect illuminance in lx\tx in m\ty in "
      "m\tz in m\n"
      "3\t4\t12.5\t0.5\t100.25\t1\t2\t0.25\n"
      "4\t4\t1\t\t\t\t\t\n");
}

// On the ramp they stand where 1, 2 and 5 of a decade lie, and nowhere else.
TEST(Contours, StandAtOneTwoAndFiveOfEveryDecade) {
  const render::Frame frame = Ramp(91, 3);
  Look look;
  look.tone = Tone::kFalseColour;
  look.scale = render::FalseColourScale{1, 1000};
  const auto plain = ColoursOf(frame, look);
  look.contours = true;
  const auto lines = ColoursOf(frame, look);
  for (int column = 0; column < 90; ++column) {
    const auto index = [](double x) {
      const double decade = std::floor(x + 1e-6), rest = std::pow(10, x - decade) * (1 + 1e-6);
      return 3 * decade + (rest >= 5 ? 2 : rest >= 2 ? 1 : 0);
    };
    const bool line = index(column / 30.0) != index((column + 1) / 30.0);
    const bool drawn = lines[4 * column] != plain[4 * column] ||
                       lines[4 * column + 1] != plain[4 * column + 1] ||
                       lines[4 * column + 2] != plain[4 * column + 2];
    // Values at a decade itself are rounded either way.
    if (column % 30 == 29 || column % 30 == 0) continue;
    EXPECT_EQ(drawn, line) << column;
  }
}

TEST(Layer, SaysWhatIsKnownOfThePicture) {
  render::Frame frame = Ramp(4, 2);
  EXPECT_FALSE(HasLayer(frame, Layer::kNoise, {}));
  EXPECT_FALSE(HasLayer(frame, Layer::kLab, {}));
  frame.variance = frame.samples = frame.coverage = core::Image(4, 2, 1);
  frame.variance.data.assign(8, 0.25f);
  frame.variance.data[1] = -1;
  const core::Image noise = LayerOf(frame, Layer::kNoise, {});
  double mean = 0;
  for (int column = 0; column < 4; ++column) mean += std::pow(10, column / 30.0) / 4;
  EXPECT_NEAR(noise.data[0], 0.5 / mean, 1e-4);
  EXPECT_EQ(noise.data[1], 0);
  core::Image reference = frame.radiance;
  ASSERT_TRUE(HasLayer(frame, Layer::kLab, {.reference = &reference}));
  EXPECT_THAT(LayerOf(frame, Layer::kLab, {.reference = &reference}).data, testing::Each(0));
  reference.data[0] *= 2;
  EXPECT_EQ(LayerOf(frame, Layer::kLab, {.reference = &reference}).data,
            core::LabDifference(frame.radiance, reference).data);
  reference = core::Image(3, 2, 3);
  EXPECT_FALSE(HasLayer(frame, Layer::kLab, {.reference = &reference}));
}

// Feedback of a small picture is stretched over the frame, and black where it tells nothing.
TEST(Layer, FeedbackIsStretched) {
  const render::Frame frame = Ramp(4, 2);
  render::Feedback feedback;
  const LayerSources sources{.feedback = &feedback};
  EXPECT_FALSE(HasLayer(frame, Layer::kLightShare, {}));
  EXPECT_FALSE(HasLayer(frame, Layer::kLightShare, sources));
  feedback.light_share = feedback.image_share = core::Image(2, 1, 1);
  feedback.light_share.data = {0.25f, 1};
  feedback.image_share.data = {0.5f, std::nanf("")};
  ASSERT_TRUE(HasLayer(frame, Layer::kImageShare, sources));
  EXPECT_THAT(LayerOf(frame, Layer::kLightShare, sources).data,
              testing::ElementsAre(0.25f, 0.25f, 1, 1, 0.25f, 0.25f, 1, 1));
  Look look;
  look.tone = Tone::kFalseColour;
  look.layer = Layer::kImageShare;
  const auto colours = ColoursOf(frame, look, sources);
  const core::Rgb middle = core::FalseColour(0.5);
  EXPECT_EQ(colours[0], std::lround(255 * middle[0]));
  EXPECT_EQ(colours[4 * 3], 0);
}

// Coverage of a half has the colour in the middle of the scale.
TEST(Layer, LinearScalesBeginAtZero) {
  render::Frame frame = Ramp(3, 1);
  frame.coverage = core::Image(3, 1, 1);
  frame.coverage.data = {0, 0.5, 1};
  Look look;
  look.tone = Tone::kFalseColour;
  look.layer = Layer::kCoverage;
  const auto colours = ColoursOf(frame, look);
  for (int i = 0; i < 3; ++i) {
    const core::Rgb expected = core::FalseColour(0.5 * i);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(colours[4 * i + c], std::lround(255 * expected[c]));
  }
}

// A share of a sample is none.
TEST(Layer, SamplesAreCountedFromOne) {
  core::Image samples(8, 1, 1);
  samples.data.assign(8, 16);
  const render::FalseColourScale few = AutomaticScaleOf(samples, Layer::kSamples);
  EXPECT_EQ(few.min, 1);
  EXPECT_DOUBLE_EQ(few.max, 20);
  samples.data.assign(8, 2e4f);
  EXPECT_DOUBLE_EQ(AutomaticScaleOf(samples, Layer::kSamples).min, 20);
  samples.data.assign(8, 0);
  const render::FalseColourScale none = AutomaticScaleOf(samples, Layer::kSamples);
  EXPECT_LT(none.min, none.max);
}

}  // namespace
}  // namespace luxfield::view
