// The program as a user runs it, in a window of a virtual display.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "luxfield/core/colour.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/core/random.h"
#include "luxfield/render/film/film.h"
#include "luxfield/view/picture/reading.h"
#include "tests/e2e/program.h"
#include "tests/e2e/tiny_session.h"
#include "tests/seed.h"
#include "tests/view/scene_file.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using e2e::Outcome;
using e2e::RunLuxfield;
using testing::HasSubstr;

class WindowTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (auto display = VirtualDisplay::Start()) display_.emplace(std::move(*display));
  }
  static void TearDownTestSuite() { display_.reset(); }
  void SetUp() override {
    if (!display_)
      GTEST_SKIP() << "SKIPPED: Xvfb is missing: no window of `luxfield view` is tested";
    std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ranges::replace(name, '/', '_');
    folder_ = e2e::FreshFolder(name);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome View(std::vector<std::string> words) const {
    words.insert(words.begin(), "view");
    return RunLuxfield(words, folder_);
  }
  void Render(std::vector<std::string> words) const {
    words.insert(words.begin(), "render");
    const Outcome outcome = RunLuxfield(words, folder_);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  cv::Mat Png(const char* name) const { return cv::imread((folder_ / name).string()); }

  static std::optional<VirtualDisplay> display_;
  fs::path folder_;
};
std::optional<VirtualDisplay> WindowTest::display_;

// Bytes that differ, and by how much at most.
std::pair<int, double> Difference(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat apart;
  cv::absdiff(a, b, apart);
  double most = 0;
  cv::minMaxLoc(apart.reshape(1), nullptr, &most);
  return {cv::countNonZero(apart.reshape(1)), most};
}

TEST_F(WindowTest, APictureStandsOnTheScreenAsRenderWritesIt) {
  WriteSceneFile(folder_);
  Render({"scene.toml", "-o", "x.exr", "--png", "x.png", "--spp", "40"});
  const Outcome outcome = View({"x.exr", "--screenshot", "s.png", "--size", "160x120", "--bare"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Difference(Png("s.png"), Png("x.png")), (std::pair{0, 0.0}));
  Render({"scene.toml", "-o", "f.exr", "--png", "f.png", "--spp", "40", "--tone", "filmic"});
  View({"f.exr", "--screenshot", "f_shown.png", "--size", "160x120", "--bare", "--tone", "filmic"});
  EXPECT_EQ(Difference(Png("f_shown.png"), Png("f.png")), (std::pair{0, 0.0}));
  EXPECT_NE(Difference(Png("f.png"), Png("x.png")).first, 0);
  Render({"scene.toml", "-o", "x.exr", "--png", "y.png", "--spp", "40", "--exposure", "0.05"});
  View({"x.exr", "--screenshot", "t.png", "--size", "160x120", "--bare", "--exposure", "0.05"});
  EXPECT_EQ(Difference(Png("t.png"), Png("y.png")), (std::pair{0, 0.0}));
}

TEST_F(WindowTest, AForeignPictureOfOneChannelIsGrey) {
  core::Image ramp(64, 48, 1);
  for (int row = 0; row < 48; ++row)
    for (int column = 0; column < 64; ++column)
      ramp.at(0, row, column) = static_cast<float>(column) / 64;
  core::WriteExrImage(folder_ / "ramp.exr", ramp);
  const Outcome outcome =
      View({"ramp.exr", "--screenshot", "s.png", "--size", "64x48", "--bare", "--exposure", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const cv::Mat shown = Png("s.png");
  for (int column = 0; column < 64; ++column)
    for (int c = 0; c < 3; ++c)
      EXPECT_EQ(shown.at<cv::Vec3b>(20, column)[c],
                std::lround(255 * core::SrgbEncode(column / 64.0)));
}

// Four scenes: matt, glossy, with a second lamp, and with an area light.
constexpr const char* kMore[] = {
    "",
    "[[box]]\nsize = [2, 0.1, 1]\nposition = [0, 4, 0.5]\nmaterial = \"gloss\"\n[[material]]\n"
    "name = \"gloss\"\nkind = \"ggx\"\nalbedo = [0.4, 0.4, 0.5]\nroughness = 0.5\n",
    "[[luminaire]]\nname = \"second\"\nfile = \"lamp.lf.exr\"\nposition = [-1, 1, 0.8]\n"
    "look_at = [1, 4, 0]\nscale = 0.5\n",
    "[[light]]\nkind = \"rectangle\"\nradiance = [300, 300, 250]\nsize = [0.5, 0.5]\n"
    "position = [-1, 2, 2]\nlook_at = [0, 2.5, 0]\nup = [0, 1, 0]\n"};

class ReadingsTest : public WindowTest, public testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Scenes, ReadingsTest, testing::Range(0, 4));

// What stands under the cursor is what `render` writes, within the two errors that are stated.
TEST_P(ReadingsTest, AreRendersWithinTheStatedError) {
  WriteSceneFile(folder_);
  e2e::WriteText(folder_ / "scene.toml", std::string(kSceneText) + kMore[GetParam()]);
  constexpr int kPoints = 250;
  core::Random random(TestSeed(11), static_cast<std::uint64_t>(GetParam()));
  std::vector<std::string> words{"scene.toml", "--screenshot", "s.png",   "--size",
                                 "160x120",    "--bare",       "--error", "2%",
                                 "--json",     "v.json",       "--seed",  "5"};
  for (int i = 0; i < kPoints; ++i) {
    words.push_back("--read");
    words.push_back(fmt::format("{},{}", static_cast<int>(160 * random.Uniform()),
                                static_cast<int>(120 * random.Uniform())));
  }
  const Outcome outcome = View(words);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  Render({"scene.toml", "-o", "x.exr", "--png", "x.png", "--spp", "600", "--seed", "77"});
  const render::Frame frame = render::ReadFrame(folder_ / "x.exr");
  const core::Json json = core::ReadJson(folder_ / "v.json");
  EXPECT_LE(json["estimated_rel_rmse"].get<double>(), 0.02);
  EXPECT_EQ(json["unit"], "lm");
  ASSERT_EQ(json["readings"].size(), kPoints);
  double mean = 0;
  for (std::size_t i = 0; i < frame.radiance.plane_size(); ++i)
    mean += core::Luminance({frame.radiance.plane(0)[i], frame.radiance.plane(1)[i],
                             frame.radiance.plane(2)[i]}) /
            static_cast<double>(frame.radiance.plane_size());
  double squares = 0;
  for (const auto& reading : json["readings"]) {
    const int column = reading["column"], row = reading["row"];
    const double truth =
        core::Luminance({frame.radiance.at(0, row, column), frame.radiance.at(1, row, column),
                         frame.radiance.at(2, row, column)});
    const double apart = reading["luminance"].get<double>() - truth;
    squares += apart * apart / kPoints;
    const double sigma = std::hypot(reading["luminance_sigma"].get<double>(),
                                    ReadAt(frame, column, row)->luminance_sigma.value());
    // Far beyond any normal scatter, with a share of the mean for what hardly any sample meets.
    EXPECT_LT(std::abs(apart), 6 * sigma + 0.02 * mean) << column << "," << row;
    if (GetParam() == 0 && reading.contains("illuminance") && truth > 0) {
      EXPECT_NEAR(reading["luminance"].get<double>() / reading["illuminance"].get<double>(),
                  truth / core::Luminance({frame.irradiance.at(0, row, column),
                                           frame.irradiance.at(1, row, column),
                                           frame.irradiance.at(2, row, column)}),
                  1e-3);
    }
  }
  // RMS over points of which few may be in a penumbra; the scatter of 250 squares is some 10 %.
  EXPECT_LT(std::sqrt(squares) / mean, 2 * 0.02);
  const cv::Mat shown = Png("s.png"), written = Png("x.png");
  ASSERT_EQ(shown.size(), written.size());
  cv::Mat apart;
  cv::absdiff(shown, written, apart);
  EXPECT_LT(cv::mean(apart)[1], 2.5);  // of 255
}

TEST_F(WindowTest, ALightFieldStandsOnAStage) {
  WriteSceneFile(folder_);
  const Outcome outcome =
      View({"lamp.lf.exr", "--screenshot", "s.png", "--size", "700x500", "--frames", "2", "--width",
            "200", "--height", "150", "--json", "v.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Png("s.png").size(), cv::Size(700, 500));
  EXPECT_GE(core::ReadJson(folder_ / "v.json")["frames"], 2);
}

// The map of a whole session is the colour of what is done, and the folder stays as it is.
TEST_F(WindowTest, ASessionIsAMap) {
  e2e::WriteText(folder_ / "lab.toml", e2e::TinyLab(100, 0));
  e2e::WriteText(folder_ / "plan.toml", e2e::TinyPlan(4, 3));
  const Outcome capture = RunLuxfield({"capture", "plan.toml", "s", "--lab", "lab.toml"}, folder_);
  ASSERT_EQ(capture.exit_code, 0) << capture.err;
  const std::string journal = e2e::ReadText(folder_ / "s" / "journal.jsonl");
  const Outcome outcome = View({"s", "--screenshot", "s.png", "--size", "700x500"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(e2e::ReadText(folder_ / "s" / "journal.jsonl"), journal);
  EXPECT_EQ(RunLuxfield({"verify", "s"}, folder_).exit_code, 0);
  cv::Mat done;
  cv::inRange(Png("s.png"), cv::Scalar(178, 114, 0), cv::Scalar(178, 114, 0), done);
  cv::Mat labels;
  EXPECT_GE(cv::connectedComponents(done, labels) - 1, 4 * 3);  // and the key's square
}

TEST_F(WindowTest, WhatCannotBeShownIsASentenceInTheWindow) {
  WriteSceneFile(folder_);
  const std::string lamp = e2e::ReadText(folder_ / "lamp.lf.exr");
  e2e::WriteText(folder_ / "cut.lf.exr", lamp.substr(0, lamp.size() / 2));
  e2e::WriteText(folder_ / "cut.exr", lamp.substr(0, 100));
  e2e::WriteText(folder_ / "wrong.toml", "[camera\n");
  e2e::WriteText(folder_ / "photo.png", "\x89PNG\r\n\x1a\n");
  e2e::WriteText(folder_ / "any.txt", "words");
  std::string lampless(kSceneText);
  lampless.replace(lampless.find("lamp.lf.exr"), 11, "none.lf.exr");
  e2e::WriteText(folder_ / "lampless.toml", lampless);
  e2e::WriteText(folder_ / "cut.toml", std::string(kSceneText).substr(0, 300));
  e2e::WriteText(folder_ / "meshless.toml",
                 std::string(kSceneText) + "[[mesh]]\nfile = \"none.glb\"\n");
  e2e::WriteText(folder_ / "skyless.toml",
                 std::string(kSceneText) + "[environment]\nfile = \"none.hdr\"\n");
  core::WriteExrImage(folder_ / "foreign.lf.exr", core::Image(4, 3, 3));
  e2e::WriteText(folder_ / "void.exr", "");
  fs::create_directory(folder_ / "empty");
  fs::create_directory(folder_ / "spoilt");  // a session whose plan ends at once
  e2e::WriteText(folder_ / "spoilt" / "plan.json", "{\n");
  e2e::WriteText(folder_ / "spoilt" / "journal.jsonl", "");
  const std::map<std::string, std::string> named_otherwise = {{"lampless.toml", "none.lf.exr"},
                                                              {"meshless.toml", "none.glb"},
                                                              {"skyless.toml", "none.hdr"},
                                                              {"spoilt", "plan.json"}};
  for (const std::string name :
       {"cut.lf.exr", "foreign.lf.exr", "cut.exr", "void.exr", "wrong.toml", "cut.toml",
        "lampless.toml", "meshless.toml", "skyless.toml", "photo.png", "any.txt", "empty", "spoilt",
        "nowhere.exr", "nowhere"}) {
    fs::remove(folder_ / "s.png");
    const Outcome outcome = View({name, "--screenshot", "s.png", "--size", "500x300"});
    EXPECT_EQ(outcome.exit_code, 2) << name << ": " << outcome.err;
    const auto other = named_otherwise.find(name);
    EXPECT_THAT(outcome.err, HasSubstr(other == named_otherwise.end() ? name : other->second));
    cv::Mat grey;
    cv::cvtColor(Png("s.png"), grey, cv::COLOR_BGR2GRAY);
    // Letters on the dark ground.
    EXPECT_GT(cv::countNonZero(grey > 150), 300) << name;
  }
}

TEST_F(WindowTest, OptionsThatMakeNoSenseAreRefused) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"x.exr", "--size", "12"}, "--size"},
      {{"x.exr", "--size", "0x9"}, "--size"},
      {{"x.exr", "--frames", "3"}, "--frames is of --screenshot"},
      {{"x.exr", "--screenshot", "s.jpg"}, ".png"},
      {{"x.exr", "--read", "1;2"}, "--read"},
      {{"x.exr", "--error", "0%"}, "--error"},
      {{"x.exr", "--exposure", "-1"}, "--exposure"},
      {{"x.exr", "--scale", "1", "2"}, "--scale is of --false-colour"},
      {{"x.exr", "--false-colour", "--scale", "2", "1"}, "--scale"}};
  for (const auto& [words, said] : wrong) {
    const Outcome outcome = View(words);
    EXPECT_EQ(outcome.exit_code, 2) << said;
    EXPECT_THAT(outcome.err, HasSubstr(said));
  }
}

TEST_F(WindowTest, WithoutADisplayItSaysSo) {
  const std::string display = getenv("DISPLAY");
  unsetenv("DISPLAY");
  core::WriteExrImage(folder_ / "x.exr", core::Image(2, 2, 3));
  const Outcome outcome = View({"x.exr", "--screenshot", "s.png"});
  setenv("DISPLAY", display.c_str(), 1);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("no window can be opened"));
  EXPECT_FALSE(fs::exists(folder_ / "s.png"));
}

}  // namespace
}  // namespace luxfield::view
