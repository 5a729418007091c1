// `luxfield view --record` as a user runs it, without a display.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "luxfield/core/exr.h"
#include "luxfield/core/json.h"
#include "luxfield/render/accuracy/accuracy.h"
#include "luxfield/render/film/film.h"
#include "tests/e2e/program.h"
#include "tests/view/scene_file.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using e2e::Outcome;
using testing::HasSubstr;

constexpr char kPath[] = R"(frames_per_s = 2
[[luminaire]]
name = "lamp"
[[luminaire.key]]
t_s = 0
position = [0, 0, 0.6]
look_at = [0, 5, 0.3]
[[luminaire.key]]
t_s = 1
position = [0.5, 0, 0.8]
look_at = [0, 5, 0.3]
)";

class RecordingTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
    WriteSceneFile(folder_);
    e2e::WriteText(folder_ / "path.toml", kPath);
    if (const char* display = getenv("DISPLAY")) display_ = display;
    unsetenv("DISPLAY");
  }
  void TearDown() override {
    if (!display_.empty()) setenv("DISPLAY", display_.c_str(), 1);
    fs::remove_all(folder_);
  }
  Outcome Record(std::vector<std::string> words) const {
    words.insert(words.begin(), {"view", "scene.toml", "--record", "path.toml", "--width", "60",
                                 "--height", "44", "--error", "4%"});
    return e2e::RunLuxfield(words, folder_);
  }

  fs::path folder_;
  std::string display_;
};

// The last frame is the picture of a scene whose file has the lamp there.
TEST_F(RecordingTest, FramesAreWhatRenderMakesOfTheLampThere) {
  const Outcome outcome =
      Record({"-o", "frames", "--json", "r.json", "--exposure", "0.02", "--seed", "3"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const core::Json json = core::ReadJson(folder_ / "r.json");
  ASSERT_EQ(json["frames"].size(), 3);
  for (const char* name : {"frame_0000", "frame_0001", "frame_0002"})
    for (const char* ending : {".exr", ".png"})
      EXPECT_TRUE(fs::exists(folder_ / "frames" / (std::string(name) + ending))) << name << ending;
  std::string moved = kSceneText;
  moved.replace(moved.find("position = [0, 0, 0.6]"), 22, "position = [0.5, 0, 0.8]");
  e2e::WriteText(folder_ / "moved.toml", moved);
  const Outcome render =
      e2e::RunLuxfield({"render", "moved.toml", "-o", "m.exr", "--png", "m.png", "--width", "60",
                        "--height", "44", "--spp", "2000", "--exposure", "0.02", "--seed", "9"},
                       folder_);
  ASSERT_EQ(render.exit_code, 0) << render.err;
  const render::Frame last = render::ReadFrame(folder_ / "frames" / "frame_0002.exr"),
                      first = render::ReadFrame(folder_ / "frames" / "frame_0000.exr"),
                      truth = render::ReadFrame(folder_ / "m.exr");
  const double stated = json["frames"][2]["estimated_rel_rmse"];
  EXPECT_LE(stated, 0.04);
  // The estimate scatters, and so does the reference.
  EXPECT_LT(render::LuminanceError(last.radiance, truth.radiance), 1.5 * 0.04);
  EXPECT_GT(render::LuminanceError(first.radiance, truth.radiance), 0.1);
  cv::Mat apart;
  cv::absdiff(cv::imread((folder_ / "frames" / "frame_0002.png").string()),
              cv::imread((folder_ / "m.png").string()), apart);
  EXPECT_LT(cv::mean(apart)[1], 4);  // of 255
}

TEST_F(RecordingTest, APreviewHasNoNoiseAndStatesNoErrorOfItsShadows) {
  const Outcome outcome = Record({"-o", "frames/", "--preview", "--json", "r.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const core::Json json = core::ReadJson(folder_ / "r.json");
  ASSERT_EQ(json["frames"].size(), 3);
  for (const core::Json& frame : json["frames"]) {
    EXPECT_FALSE(frame.contains("estimated_rel_rmse"));
    EXPECT_EQ(frame["samples"], 0);
  }
  const render::Frame frame = render::ReadFrame(folder_ / "frames" / "frame_0001.exr");
  EXPECT_EQ(frame.width, 60);
  for (const float variance : frame.variance.data) ASSERT_EQ(variance, 0);
}

// A program of that name which keeps what it is given.
TEST_F(RecordingTest, AVideoIsWhatFfmpegMakesOfTheFrames) {
  fs::create_directory(folder_ / "bin");
  e2e::WriteText(folder_ / "bin" / "ffmpeg",
                 "#!/bin/sh\necho \"$@\" > " + (folder_ / "words").string() +
                     "\nfor last; do :; done\ncat > \"${last#file:}\"\n");
  fs::permissions(folder_ / "bin" / "ffmpeg", fs::perms::owner_all);
  const char* const found = getenv("PATH");
  const std::string path = found ? found : "";
  setenv("PATH", ((folder_ / "bin").string() + ":" + path).c_str(), 1);
  const Outcome video = Record({"-o", "flight.mp4", "--preview", "--exposure", "0.02"});
  e2e::WriteText(folder_ / "bin" / "ffmpeg", "#!/bin/sh\ncat > /dev/null\nexit 1\n");
  const Outcome failed = Record({"-o", "failed.mp4", "--preview"});
  setenv("PATH", "/nowhere", 1);
  const Outcome missing = Record({"-o", "missing.mp4"});
  setenv("PATH", path.c_str(), 1);
  ASSERT_EQ(video.exit_code, 0) << video.err;
  EXPECT_THAT(e2e::ReadText(folder_ / "words"), HasSubstr("-video_size 60x44 -framerate 2"));
  EXPECT_EQ(failed.exit_code, 3);
  EXPECT_THAT(failed.err, HasSubstr("ffmpeg could not make the video"));
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("needs the program ffmpeg"));
  for (const char* name : {"failed.mp4", "missing.mp4"})
    EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  // The PNGs of a folder are the same pictures.
  ASSERT_EQ(Record({"-o", "frames", "--preview", "--exposure", "0.02"}).exit_code, 0);
  const std::string bytes = e2e::ReadText(folder_ / "flight.mp4");
  ASSERT_EQ(bytes.size(), 3u * 60 * 44 * 4);
  const cv::Mat png = cv::imread((folder_ / "frames" / "frame_0001.png").string());
  for (int row = 0; row < 44; ++row)
    for (int column = 0; column < 60; ++column)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(static_cast<unsigned char>(bytes[4 * (44 * 60 + row * 60 + column) + c]),
                  png.at<cv::Vec3b>(row, column)[2 - c]);
}

// Parts are parts of their wholes, and the error asked for is reached.
TEST_F(RecordingTest, ABenchSaysWhereTheTimeGoes) {
  const Outcome outcome = e2e::RunLuxfield({"view", "scene.toml", "--bench", "--width", "60",
                                            "--height", "44", "--error", "20%", "--json", "b.json"},
                                           folder_);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("after all tables are in memory"));
  const core::Json json = core::ReadJson(folder_ / "b.json");
  EXPECT_EQ(json["width"], 60);
  double sum = 0;
  for (const char* part : {"scene_s", "device_s", "lamps_s", "tables_s", "picture_s"}) {
    EXPECT_GE(json["first"][part].get<double>(), 0) << part;
    sum += json["first"][part].get<double>();
  }
  EXPECT_GT(json["first"]["picture_s"].get<double>(), 0);
  EXPECT_NEAR(json["tables_s"].get<double>(), sum, 1e-9);
  ASSERT_EQ(json["moving"].size(), 4);
  for (const core::Json& row : json["moving"]) {
    EXPECT_GT(row["picture_core_s"].get<double>(), 0);
    EXPECT_GE(row["colours_core_s"].get<double>(), 0);
    EXPECT_GT(row["frame_s"].get<double>(), 0);
    EXPECT_GT(row["primary_s"].get<double>(), 0);
  }
  EXPECT_GT(json["refined_core_s"].get<double>(), 0);
  EXPECT_LE(json["estimated_rel_rmse"].get<double>(), 0.2);
}

TEST_F(RecordingTest, OptionsThatMakeNoSenseAreRefused) {
  e2e::WriteText(folder_ / "file", "");
  core::WriteExrImage(folder_ / "picture.exr", core::Image(2, 2, 3));
  for (const auto& [words, said] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{}, "--output"},
           {{"-o", "x.avi"}, "neither a folder nor a video"},
           {{"-o", "file"}, "is a file"},
           {{"-o", "f", "--screenshot", "s.png"}, "open no window"}}) {
    const Outcome outcome = Record(words);
    EXPECT_EQ(outcome.exit_code, 2) << said;
    EXPECT_THAT(outcome.err, HasSubstr(said));
  }
  EXPECT_THAT(
      e2e::RunLuxfield({"view", "picture.exr", "--record", "path.toml", "-o", "f"}, folder_).err,
      HasSubstr("nothing that moves"));
  EXPECT_THAT(e2e::RunLuxfield({"view", "scene.toml", "-o", "f"}, folder_).err,
              HasSubstr("of --record"));
}

TEST_F(RecordingTest, APathOfAnotherScenesLampMakesNoFolder) {
  std::string path = kPath;
  path.replace(path.find("\"lamp\""), 6, "\"other\"");
  e2e::WriteText(folder_ / "path.toml", path);
  const Outcome outcome = Record({"-o", "frames"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("other"));
  EXPECT_FALSE(fs::exists(folder_ / "frames"));
}

}  // namespace
}  // namespace luxfield::view
