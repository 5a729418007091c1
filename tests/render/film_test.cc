#include "luxfield/render/film/film.h"

#include <cairo.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"

namespace luxfield::render {
namespace {

std::filesystem::path Temporary(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("luxfield_film_" + name);
}

core::Image Noise(int channels, std::uint64_t seed) {
  core::Image image(7, 5, channels);
  core::Random random(seed, 0);
  for (float& value : image.data) value = static_cast<float>(1e6 * random.Uniform() - 10);
  return image;
}

Frame TestFrame() {
  Frame frame;
  frame.width = 7;
  frame.height = 5;
  frame.unit = lightfield::FluxUnit::kLumen;
  frame.radiance = Noise(3, 1);
  frame.irradiance = Noise(3, 2);
  frame.normal = Noise(3, 3);
  frame.position = Noise(3, 4);
  frame.coverage = Noise(1, 5);
  frame.variance = Noise(1, 6);
  frame.samples = Noise(1, 7);
  frame.alpha = Noise(1, 8);
  frame.provenance = {{"seed", "3"}};
  return frame;
}

TEST(Film, AovsSurviveTheFileBitByBit) {
  const Frame frame = TestFrame();
  const auto path = Temporary("frame.exr");
  WriteFrame(path, frame);
  core::ExrReader reader(path);
  ASSERT_EQ(reader.parts().size(), 1u);
  const auto expect = [&](const std::string& channel, const core::Image& image, int c) {
    EXPECT_THAT(reader.ReadFloat(0, channel), testing::ElementsAreArray(image.plane(c))) << channel;
  };
  for (int c = 0; c < 3; ++c) {
    expect(std::string(1, "RGB"[c]), frame.radiance, c);
    expect(std::string("irradiance.") + "RGB"[c], frame.irradiance, c);
    expect(std::string("normal.") + "XYZ"[c], frame.normal, c);
    expect(std::string("position.") + "XYZ"[c], frame.position, c);
  }
  expect("A", frame.alpha, 0);
  expect("coverage.Y", frame.coverage, 0);
  expect("variance.Y", frame.variance, 0);
  expect("samples.Y", frame.samples, 0);
  EXPECT_EQ(reader.GetString(0, "luxfield:unit"), "lm");
  EXPECT_EQ(reader.GetString(0, "luxfield:provenance.seed"), "3");

  const Frame again = ReadFrame(path);
  EXPECT_EQ(again.radiance.data, frame.radiance.data);
  EXPECT_EQ(again.irradiance.data, frame.irradiance.data);
  EXPECT_EQ(again.unit, frame.unit);
  const std::string bytes = core::ReadFile(path);
  WriteFrame(path, frame);
  EXPECT_EQ(core::ReadFile(path), bytes);
}

TEST(Film, OnlyRenderedPicturesAreReadAsFrames) {
  EXPECT_THROW(ReadFrame(Temporary("missing.exr")), InputError);
  core::WriteExrImage(Temporary("plain.exr"), Noise(3, 1));
  EXPECT_THAT([] { ReadFrame(Temporary("plain.exr")); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("is not a rendered picture")));
  WriteFrame(Temporary("cut.exr"), TestFrame());
  const std::string bytes = core::ReadFile(Temporary("cut.exr"));
  std::ofstream(Temporary("cut.exr"), std::ios::binary) << bytes.substr(0, bytes.size() - 40);
  EXPECT_THROW(ReadFrame(Temporary("cut.exr")), InputError);
}

TEST(Film, NamesAnAttributeOfTheWrongType) {
  const core::Image grey(7, 5, 1);
  core::ExrPartView part;
  part.width = grey.width;
  part.height = grey.height;
  part.channels.push_back({"Y", grey.plane(0)});
  part.attributes = {{"luxfield:kind", std::string("render")},
                     {"luxfield:version", 1},
                     {"luxfield:unit", std::string("lm")},
                     {"luxfield:provenance.seed", 3}};
  core::WriteExr(Temporary("typed.exr"), std::span(&part, 1));
  try {
    ReadFrame(Temporary("typed.exr"));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("luxfield:provenance.seed"));
  }
}

TEST(Film, ToneMapsByTheFormula) {
  core::Image image(2, 1, 3);
  for (int c = 0; c < 3; ++c) {
    image.at(c, 0, 0) = 1;
    image.at(c, 0, 1) = 3;  // mean luminance 2
  }
  image.at(0, 0, 0) = 1;
  const auto exponential = ToneMap(image, {.exposure = {}, .k = 2});
  EXPECT_NEAR(exponential.at(1, 0, 0), 1 - std::exp(-1.0), 1e-6);
  EXPECT_NEAR(exponential.at(1, 0, 1), 1 - std::exp(-3.0), 1e-6);
  const auto fixed = ToneMap(image, {.exposure = 0.4});
  EXPECT_FLOAT_EQ(fixed.at(0, 0, 0), 0.4f);
  EXPECT_FLOAT_EQ(fixed.at(0, 0, 1), 1.0f);
  const auto filmic = ToneMap(image, {.exposure = {}, .k = 2, .curve = ToneCurve::kFilmic});
  EXPECT_NEAR(filmic.at(1, 0, 1), FilmicTone({3, 3, 3}, 2, 2)[1], 1e-6);
  const auto black = ToneMap(core::Image(2, 1, 1), {});
  EXPECT_THAT(black.data, testing::Each(0.0f));
}

TEST(Film, PngHoldsSrgb) {
  core::Image image(2, 1, 3);
  image.at(0, 0, 0) = 1;
  image.at(1, 0, 1) = 0.5f;  // sRGB 188
  image.at(2, 0, 1) = -1;
  WritePng(Temporary("two.png"), image);
  const cv::Mat png = cv::imread(Temporary("two.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(png.type(), CV_8UC3);
  EXPECT_EQ(png.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(png.at<cv::Vec3b>(0, 1), cv::Vec3b(0, 188, 0));
}

// The first row is the top one, the first column the left one, in every writer.
TEST(Film, PicturesStandUpright) {
  core::Image image(3, 2, 3);
  image.at(1, 0, 2) = 1;  // top right, green
  image.at(0, 1, 0) = 1;  // bottom left, red
  WritePng(Temporary("upright.png"), image);
  WriteColourKeys(Temporary("keys.png"), image, "", {});
  core::Image grey(3, 2, 1);
  grey.at(0, 0, 2) = 2;
  grey.at(0, 1, 0) = 1;
  WriteFalseColour(Temporary("false.png"), grey, "", "", {1, 2});
  WriteColourScale(Temporary("scale.png"), grey, "", "", {0, 2, [](double position) {
                                                            return core::Rgb{position, position, 0};
                                                          }});
  const auto expect = [](const char* name, const cv::Vec3b& top_right,
                         const cv::Vec3b& bottom_left) {
    const cv::Mat png = cv::imread(Temporary(name).string(), cv::IMREAD_COLOR);
    for (int row = 0; row < 2; ++row)
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(png.at<cv::Vec3b>(row, column), row == 0 && column == 2   ? top_right
                                                  : row == 1 && column == 0 ? bottom_left
                                                                            : cv::Vec3b(0, 0, 0))
            << name << " row " << row << " column " << column;
  };
  expect("upright.png", {0, 255, 0}, {0, 0, 255});
  expect("keys.png", {0, 255, 0}, {0, 0, 255});
  expect("scale.png", {0, 255, 255}, {0, 128, 128});
  const auto bgr = [](const core::Rgb& rgb) {
    cv::Vec3b out;
    for (int c = 0; c < 3; ++c) out[2 - c] = static_cast<unsigned char>(std::lround(255 * rgb[c]));
    return out;
  };
  expect("false.png", bgr(core::FalseColour(1)), bgr(core::FalseColour(0)));
}

TEST(FalseColour, ColoursFollowTheLogarithmAndTheScaleIsRound) {
  core::Image image(5, 1, 1);
  const float values[5] = {0, 0.1f, 1, 10, 1000};
  for (int i = 0; i < 5; ++i) image.at(0, 0, i) = values[i];
  const auto path = Temporary("colours.png");
  WriteFalseColour(path, image, "illuminance", "lx", {0.1, 100});
  const cv::Mat png = cv::imread(path.string(), cv::IMREAD_COLOR);
  ASSERT_EQ(png.cols, 5 + 110);
  ASSERT_EQ(png.rows, 160);
  const double at[5] = {-1, 0, 1.0 / 3, 2.0 / 3, 1};
  for (int i = 0; i < 5; ++i) {
    const core::Rgb expected = at[i] < 0 ? core::Rgb{0, 0, 0} : core::FalseColour(at[i]);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(png.at<cv::Vec3b>(0, i)[2 - c], 255 * expected[c], 0.6) << i;
  }
  // The legend's bar runs over the rows 54 to 146.
  for (const int y : {56, 100, 144})
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(png.at<cv::Vec3b>(y, 5 + 19)[2 - c],
                  255 * core::FalseColour((146 - y - 0.5) / 92)[c], 1.5);
  int dark = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 5; x < 115; ++x) dark += png.at<cv::Vec3b>(y, x)[1] < 64;
  EXPECT_GT(dark, 60);  // without a font the title would be missing
}

// Ink right of the legend's bar, where labels stand, for scales from a third of a decade to sixty
// decades: every legend has two labels or more, and no row of ink joins two of them.
TEST(FalseColour, LabelsEveryScaleWithoutOverlap) {
  const double scales[][2] = {{3, 4}, {1, 1000}, {0.02, 700}, {1e-30, 1e30}};
  for (const auto& [min, max] : scales) {
    const auto path = Temporary("labels.png");
    WriteFalseColour(path, core::Image(4, 300, 1), "radiance", "cd/m2", {min, max});
    const cv::Mat png = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
    int labels = 0, run = 0;
    for (int y = 42; y < 300; ++y) {
      int ink = 0;
      for (int x = 4 + 40; x < 4 + 110; ++x) ink += png.at<unsigned char>(y, x) < 128;
      run = ink ? run + 1 : 0;
      labels += run == 1;
      EXPECT_LT(run, 13) << min << " to " << max;  // one line of 12 points
    }
    EXPECT_GE(labels, 2) << min << " to " << max;
  }
}

constexpr int kTextWidth = 60, kTextAbove = 10, kTextHeight = 14;

// `text` in the font of our legends, black on white.
cv::Mat Drawn(const std::string& text) {
  cairo_surface_t* surface =
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, kTextWidth, kTextHeight);
  cairo_t* cairo = cairo_create(surface);
  cairo_set_source_rgb(cairo, 1, 1, 1);
  cairo_paint(cairo);
  cairo_set_source_rgb(cairo, 0, 0, 0);
  cairo_select_font_face(cairo, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo, 12);
  cairo_move_to(cairo, 0, kTextAbove);
  cairo_show_text(cairo, text.c_str());
  cairo_destroy(cairo);
  cairo_surface_flush(surface);
  cv::Mat grey;
  cv::extractChannel(
      cv::Mat(kTextHeight, kTextWidth, CV_8UC4, cairo_image_surface_get_data(surface),
              cairo_image_surface_get_stride(surface)),
      grey, 0);
  cairo_surface_destroy(surface);
  return grey;
}

// Which of the texts stands right of the bar beside `position` of it, 0 at its lower end, in a
// legend of 300 rows.
std::string TextAt(const cv::Mat& png, double position, const std::vector<std::string>& texts) {
  const int middle = static_cast<int>(std::lround(286 - 232 * position));
  const int left = png.cols - 110 + 38;
  std::string best;
  double least = 255 * 10;  // of ten pixels
  for (const std::string& text : texts) {
    const cv::Mat drawn = Drawn(text);
    for (int baseline = middle + 2; baseline <= middle + 6; ++baseline) {
      const double apart = cv::norm(
          drawn, png(cv::Rect(left, baseline - kTextAbove, kTextWidth, kTextHeight)), cv::NORM_L1);
      if (apart < least) {
        least = apart;
        best = text;
      }
    }
  }
  return best;
}

TEST(FalseColour, LegendsSayWhichValueAColourStandsFor) {
  const std::vector<std::string> texts = {"0.01", "0.02", "0.05", "0.1",  "0.2",  "0.5",
                                          "1",    "1.5",  "2",    "5",    "10",   "15",
                                          "20",   "50",   "100",  "1000", "5000", "10000"};
  const auto path = Temporary("legend.png");
  WriteFalseColour(path, core::Image(4, 300, 1), "illuminance", "lx", {0.1, 1000});
  cv::Mat png = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  for (int decade = 0; decade <= 4; ++decade)
    EXPECT_EQ(TextAt(png, decade / 4.0, texts), fmt::format("{}", std::pow(10, decade - 1)));
  WriteColourScale(path, core::Image(4, 300, 1), "ratio", "", {1, 2, [](double) {
                                                                 return core::Rgb{1, 1, 1};
                                                               }});
  png = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  EXPECT_EQ(TextAt(png, 0, texts), "1");
  EXPECT_EQ(TextAt(png, 0.5, texts), "1.5");
  EXPECT_EQ(TextAt(png, 1, texts), "2");
}

TEST(FalseColour, PicksARoundScale) {
  core::Image image(100, 100, 1);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>(i) * 0.0372f;
  const auto scale = AutomaticScale(image);  // 99.9th percentile 371.6
  EXPECT_DOUBLE_EQ(scale.max, 500);
  EXPECT_DOUBLE_EQ(scale.min, 0.5);
  EXPECT_EQ(AutomaticScale(core::Image(3, 3, 3)).max, 1);
  EXPECT_THROW(WriteFalseColour(Temporary("bad.png"), image, "x", "lx", {5, 5}), InputError);
  EXPECT_THROW(WriteFalseColour(Temporary("bad.png"), image, "x", "lx", {-1, 5}), InputError);
}

TEST(FalseColour, LabelsOfOneLegendAreWrittenTheSameWay) {
  using Values = std::vector<double>;
  using Labels = std::vector<std::string>;
  EXPECT_EQ(TickLabels(Values{0.02, 5000, 50000, 500000}),
            (Labels{"0.02", "5000", "50000", "500000"}));
  EXPECT_EQ(TickLabels(Values{50000, 500000, 2e7}), (Labels{"5e4", "5e5", "2e7"}));
  EXPECT_EQ(TickLabels(Values{0, 2e-5, 1}), (Labels{"0", "2e-5", "1e0"}));
  EXPECT_EQ(TickLabels(Values{0, 1.0 / 3, 1.5, -0.25, 1234}),
            (Labels{"0", "0.3333", "1.5", "-0.25", "1234"}));
  EXPECT_EQ(TickLabels(Values{1.5e8}), (Labels{"1.5e8"}));
}

TEST(Units, FollowTheLightField) {
  EXPECT_EQ(IrradianceUnitName(lightfield::FluxUnit::kLumen), "lx");
  EXPECT_EQ(RadianceUnitName(lightfield::FluxUnit::kLumen), "cd/m2");
  EXPECT_EQ(IrradianceUnitName(lightfield::FluxUnit::kWatt), "W/m2");
  EXPECT_EQ(RadianceUnitName(lightfield::FluxUnit::kRelative), "rel.");
}

}  // namespace
}  // namespace luxfield::render
