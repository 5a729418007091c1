// Hands on the window: keys and mouse by xdotool, on a virtual display.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "luxfield/core/colour.h"
#include "luxfield/core/json.h"
#include "luxfield/render/film/film.h"
#include "luxfield/scene/scene.h"
#include "luxfield/view/picture/reading.h"
#include "luxfield/view/scene_file/lamp_handles.h"
#include "luxfield/view/scene_file/scene_edits.h"
#include "tests/e2e/program.h"
#include "tests/e2e/tiny_session.h"
#include "tests/view/scene_file.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using e2e::Outcome;

// Pixels of the scene's picture: its middle, and some of the floor.
const std::vector<std::string> kReads{"--read", "80,60",  "--read", "40,80",  "--read", "60,90",
                                      "--read", "100,90", "--read", "120,80", "--read", "80,80",
                                      "--read", "30,60",  "--read", "130,60"};

class InteractionTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (auto display = VirtualDisplay::Start()) display_.emplace(std::move(*display));
  }
  static void TearDownTestSuite() { display_.reset(); }
  void SetUp() override {
    folder_ = e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
    if (!display_ || e2e::RunProgram({"xdotool", "version"}, folder_).exit_code != 0)
      GTEST_SKIP() << "SKIPPED: Xvfb or xdotool is missing: no hand on `luxfield view` is tested";
    WriteSceneFile(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Hand(std::vector<std::string> words) const {
    words.insert(words.begin(), "xdotool");
    fs::create_directories(folder_ / "hand");  // whose output files are its own
    const Outcome outcome = e2e::RunProgram(words, folder_ / "hand");
    ASSERT_EQ(outcome.exit_code, 0) << words[1] << ": " << outcome.err;
  }
  // The window sees all that hands do, in order, however late.
  void Press(const std::string& key) const { Hand({"key", key}); }
  static void Pause() { std::this_thread::sleep_for(std::chrono::milliseconds(50)); }

  void FindWindow() {
    fs::create_directories(folder_ / "hand");
    const Outcome found = e2e::RunProgram(
        {"xdotool", "search", "--sync", "--onlyvisible", "--name", "luxfield"}, folder_ / "hand");
    window_ = found.out.substr(0, found.out.find('\n'));
    Hand({"windowfocus", "--sync", window_});
  }

  // Its title ends in dots until the picture that was asked for last is whole.
  bool IsAtWork() const {
    const Outcome name = e2e::RunProgram({"xdotool", "getwindowname", window_}, folder_ / "hand");
    return name.out.find("...") != std::string::npos;
  }
  void WaitUntilItIsLit() const {
    for (int i = 0; i < 6000; ++i, Pause())
      if (!IsAtWork()) return;
    ADD_FAILURE() << "the picture does not come to rest";
  }

  // Opens the scene, and closes it when it shows what it is to show.
  void ViewUntilSettled() {
    std::vector<std::string> words{"view",    "scene.toml", "--screenshot", "s.png",   "--size",
                                   "640x400", "--json",     "v.json",       "--error", "20%"};
    words.insert(words.end(), kReads.begin(), kReads.end());
    const Outcome outcome = e2e::RunLuxfield(words, folder_);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    json_ = core::ReadJson(folder_ / "v.json");
  }

  // Opens the scene, lets `hands` do something with the window of that number, and closes it; the
  // screenshot shows what it comes to then.
  void ViewWith(const std::function<void(const std::string& window)>& hands) {
    std::vector<std::string> words{"scene.toml", "--size", "640x400", "--error", "20%"};
    words.insert(words.end(), kReads.begin(), kReads.end());
    ViewWith(words, hands);
  }
  void ViewWith(std::vector<std::string> words,
                const std::function<void(const std::string& window)>& hands, int exit_code = 0) {
    words.insert(words.begin(), "view");
    words.insert(words.end(), {"--screenshot", "s.png", "--until-closed", "--json", "v.json"});
    auto view = std::async(std::launch::async, [&] { return e2e::RunLuxfield(words, folder_); });
    FindWindow();
    hands(window_);
    Press("ctrl+q");
    outcome_ = view.get();
    ASSERT_EQ(outcome_.exit_code, exit_code) << outcome_.err;
    shown_ = cv::imread((folder_ / "s.png").string());
    if (exit_code == 0) json_ = core::ReadJson(folder_ / "v.json");
  }

  void Render(std::vector<std::string> words) const {
    words.insert(words.begin(), "render");
    const Outcome outcome = e2e::RunLuxfield(words, folder_);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  // What the window said of its middle pixel is what `render` says of the file as it is now, both of
  // them with the error that they state.
  void ExpectReadingOfSavedScene() {
    Render({"scene.toml", "-o", "saved.exr", "--spp", "400", "--antialias", "4", "--seed", "77"});
    const render::Frame frame = render::ReadFrame(folder_ / "saved.exr");
    const core::Json& reading = json_["readings"][0];
    const int column = reading["column"], row = reading["row"];
    const double truth = LuminanceAt(frame, column, row);
    const double sigma = std::hypot(reading["luminance_sigma"].get<double>(),
                                    std::sqrt(frame.variance.at(0, row, column)));
    EXPECT_NEAR(reading["luminance"].get<double>(), truth, 6 * sigma + 1e-4 * truth);
  }

  double SumOfReadings() const {
    double sum = 0;
    for (const core::Json& reading : json_["readings"]) sum += reading["luminance"].get<double>();
    return sum;
  }

  static double LuminanceAt(const render::Frame& frame, int column, int row) {
    return core::Luminance({frame.radiance.at(0, row, column), frame.radiance.at(1, row, column),
                            frame.radiance.at(2, row, column)});
  }

  static std::optional<VirtualDisplay> display_;
  fs::path folder_;
  std::string window_;
  Outcome outcome_;
  cv::Mat shown_;
  core::Json json_;
};
std::optional<VirtualDisplay> InteractionTest::display_;

// The share of pixels that are coloured, in the left of the window, where the picture is.
double Coloured(const cv::Mat& shown) {
  int coloured = 0;
  for (int row = 0; row < shown.rows; ++row)
    for (int column = 0; column < shown.cols / 2; ++column) {
      const auto& pixel = shown.at<cv::Vec3b>(row, column);
      coloured += std::abs(pixel[0] - pixel[2]) > 40 ? 1 : 0;
    }
  return coloured / (0.5 * shown.rows * shown.cols);
}

TEST_F(InteractionTest, KeysChooseTheToneAndShowTheHelp) {
  ViewWith([&](const std::string&) {});
  const cv::Mat before = shown_.clone();
  ViewWith([&](const std::string&) { Press("3"); });
  EXPECT_EQ(shown_.size(), before.size());
  EXPECT_GT(Coloured(shown_), Coloured(before) + 0.1);
  ViewWith([&](const std::string&) { Press("F1"); });
  cv::Mat apart;
  cv::absdiff(shown_, before, apart);
  EXPECT_GT(cv::countNonZero(apart.reshape(1)), shown_.rows * shown_.cols / 40);
}

TEST_F(InteractionTest, ADragTurnsTheCamera) {
  ViewUntilSettled();
  const core::Json before = json_["readings"][0];
  ViewWith([&](const std::string& window) {
    WaitUntilItIsLit();
    Hand({"mousemove", "--window", window, "150", "150", "mousedown", "1", "mousemove_relative",
          "60", "0", "mouseup", "1"});
  });
  const core::Json after = json_["readings"][0];
  ASSERT_TRUE(before.contains("position_m"));
  EXPECT_TRUE(!after.contains("position_m") || after["position_m"] != before["position_m"]);
}

// The arrow along x: the lamp goes where the pointer takes it, the exposure rises, the file says so
// after saving, and the window shows what `render` writes of it.
TEST_F(InteractionTest, AHandleMovesALampAndItIsSaved) {
  Render({"scene.toml", "-o", "x.exr", "--png", "before.png", "--exposure", "0.1"});
  const scene::Camera camera = scene::ReadScene(folder_ / "scene.toml").camera;
  const LampPlacement before = ReadSceneEdits(folder_ / "scene.toml").lamps.at(0);
  const lightfield::Vec3 axis{1, 0, 0};
  const PicturePoint tip =
      *SeenAt(camera, before.position + 0.12 * HeightAt(camera, before.position) * axis);
  // The picture's pixels stand twice as large in the middle of what panel and bar leave, and three
  // times without these.
  constexpr int kScale = 2, kLeft = 2, kTop = 58, kDrag = 36;
  constexpr int kBareScale = 3, kBareLeft = 80, kBareTop = 20;
  const int column = kLeft + static_cast<int>(kScale * tip.column),
            row = kTop + static_cast<int>(kScale * tip.row);
  ViewWith(
      {"scene.toml", "--size", "640x400", "--error", "4%", "--exposure", "0.05", "--read", "80,60"},
      [&](const std::string& window) {
        WaitUntilItIsLit();
        Hand({"mousemove", "--window", window, std::to_string(column), std::to_string(row),
              "mousedown", "1", "mousemove_relative", std::to_string(kDrag), "0", "mouseup", "1"});
        Press("ctrl+s");
        for (int i = 0; i < 3; ++i) Press("equal");
        Press("h");
      });
  const LampPlacement after = ReadSceneEdits(folder_ / "scene.toml").lamps.at(0);
  const auto along = [&](double right) {
    return AlongAxis(camera, {tip.column + right / kScale, tip.row}, before.position, axis).value();
  };
  EXPECT_NEAR(after.position.x - before.position.x, along(kDrag) - along(0),
              0.03 * (along(kDrag) - along(0)));
  EXPECT_EQ(after.position.y, before.position.y);
  EXPECT_EQ(after.position.z, before.position.z);
  EXPECT_THAT(e2e::ReadText(folder_ / "scene.toml"), testing::HasSubstr("# A lamp over a floor."));
  ExpectReadingOfSavedScene();
  Render({"scene.toml", "-o", "x.exr", "--png", "after.png", "--exposure", "0.1"});
  ASSERT_EQ(shown_.size(), cv::Size(640, 400));
  cv::Mat picture;
  cv::resize(shown_(cv::Rect(kBareLeft, kBareTop, kBareScale * 160, kBareScale * 120)), picture,
             {160, 120}, 0, 0, cv::INTER_NEAREST);
  const auto apart = [&](const char* png) {
    cv::Mat difference;
    cv::absdiff(picture, cv::imread((folder_ / png).string()), difference);
    return cv::mean(difference)[1];
  };
  EXPECT_LT(apart("after.png"), 3);  // of 255
  EXPECT_GT(apart("before.png"), 3 * apart("after.png"));
}

// The number of a lamp's green, in the panel on the right: the window lights with it at once, and the
// file says it after saving.
TEST_F(InteractionTest, AColourIsDraggedAndSaved) {
  ViewWith({"scene.toml", "--size", "640x400", "--error", "4%", "--read", "80,60"},
           [&](const std::string& window) {
             WaitUntilItIsLit();
             Hand({"mousemove", "--window", window, "438", "256", "mousedown", "1",
                   "mousemove_relative", "--", "-200", "0", "mouseup", "1"});
             Press("ctrl+s");
           });
  const LampPlacement lamp = ReadSceneEdits(folder_ / "scene.toml").lamps.at(0);
  EXPECT_EQ(lamp.colour[0], 1);
  EXPECT_LT(lamp.colour[1], 0.6);
  EXPECT_GT(lamp.colour[1], 0.2);
  EXPECT_EQ(lamp.colour[2], 1);
  EXPECT_THAT(e2e::ReadText(folder_ / "scene.toml"), testing::HasSubstr("# A lamp over a floor."));
  ExpectReadingOfSavedScene();
}

// The copy is lit, and stands in the file that was saved.
// Ctrl is let go of before the letter, which does not move the camera then.
TEST_F(InteractionTest, ALampIsCopiedAndTheSceneSaved) {
  ViewUntilSettled();
  const double alone = SumOfReadings();
  ViewWith([&](const std::string&) {
    WaitUntilItIsLit();
    for (const char* letter : {"d", "s"}) {
      Hand({"keydown", "ctrl", "keydown", letter, "keyup", "ctrl"});
      Pause();
      Hand({"keyup", letter});
    }
  });
  const SceneEdits saved = ReadSceneEdits(folder_ / "scene.toml");
  ASSERT_EQ(saved.lamps.size(), 2);
  EXPECT_EQ(saved.lamps[1].name, "lamp 2");
  EXPECT_GT(SumOfReadings(), 1.3 * alone);
  ExpectReadingOfSavedScene();
}

// A file that others write is read again, with the camera where it was.
TEST_F(InteractionTest, AFileThatOthersWriteIsReadAgain) {
  ViewWith({"scene.toml", "--size", "640x400", "--error", "3%", "--read", "80,60"},
           [&](const std::string&) {
             WaitUntilItIsLit();
             std::string text = e2e::ReadText(folder_ / "scene.toml");
             text.replace(text.find("albedo = [0.5, 0.4, 0.3]"), 24, "albedo = [0.9, 0.9, 0.9]");
             // Again where the work was done between two looks at it.
             bool seen = false;
             for (int written = 0; written < 20 && !seen; ++written) {
               e2e::WriteText(folder_ / "scene.toml", text);
               for (int i = 0; i < 100 && !seen; ++i, Pause()) seen = IsAtWork();
             }
             EXPECT_TRUE(seen);
           });
  ExpectReadingOfSavedScene();
}

// A picture's exposure goes by thirds of stops.
TEST_F(InteractionTest, KeysChangeTheExposure) {
  Render({"scene.toml", "-o", "x.exr", "--spp", "40"});
  ViewWith({"x.exr", "--size", "160x120", "--bare"}, [&](const std::string&) {
    for (int i = 0; i < 4; ++i) Press("equal");
    Press("minus");
  });
  const render::Frame frame = render::ReadFrame(folder_ / "x.exr");
  render::WritePng(folder_ / "brighter.png",
                   render::ToneMap(frame.radiance, {.exposure = {}, .k = 2}));
  const cv::Mat expected = cv::imread((folder_ / "brighter.png").string());
  ASSERT_EQ(shown_.size(), expected.size());
  EXPECT_LE(cv::norm(shown_, expected, cv::NORM_INF), 1);  // factors of 2^(1/3) are rounded
}

// A double click leaves a probe that says what the file says there.
TEST_F(InteractionTest, ADoubleClickReadsThePixel) {
  Render({"scene.toml", "-o", "x.exr", "--spp", "40"});
  constexpr int kColumn = 101, kRow = 87;
  ViewWith({"x.exr", "--size", "160x120", "--bare"}, [&](const std::string& window) {
    Hand({"mousemove", "--window", window, std::to_string(kColumn), std::to_string(kRow), "click",
          "--repeat", "2", "--delay", "1", "1"});
  });
  const render::Frame frame = render::ReadFrame(folder_ / "x.exr");
  ASSERT_EQ(json_["probes"].size(), 1);
  const core::Json& probe = json_["probes"][0];
  EXPECT_EQ(probe["column"], kColumn);
  EXPECT_EQ(probe["row"], kRow);
  EXPECT_NEAR(probe["luminance"].get<double>(), LuminanceAt(frame, kColumn, kRow),
              1e-6 * LuminanceAt(frame, kColumn, kRow));
  EXPECT_NEAR(probe["luminance_sigma"].get<double>(),
              ReadAt(frame, kColumn, kRow)->luminance_sigma.value(), 1e-6);
  EXPECT_NEAR(probe["position_m"][1].get<double>(), frame.position.at(1, kRow, kColumn), 1e-6);
}

// The wheel brings the camera nearer to the stage's screen.
TEST_F(InteractionTest, TheWheelMovesTheCameraBeforeALightField) {
  const std::vector<std::string> words{"lamp.lf.exr", "--size",   "640x400", "--width",
                                       "80",          "--height", "60",      "--read",
                                       "40,30",       "--error",  "50%",     "--bare"};
  ViewWith(words, [&](const std::string&) {});
  const core::Json before = json_["readings"][0];
  ViewWith(words, [&](const std::string& window) {
    WaitUntilItIsLit();
    Hand({"mousemove", "--window", window, "200", "150", "click", "--repeat", "6", "4"});
  });
  ASSERT_TRUE(before.contains("position_m"));
  ASSERT_TRUE(json_["readings"][0].contains("position_m"));
  EXPECT_NE(json_["readings"][0]["luminance"], before["luminance"]);
}

// A position of the map says what it is when the pointer is there, and nothing is written.
TEST_F(InteractionTest, ThePointerReadsASessionsMap) {
  e2e::WriteText(folder_ / "lab.toml", e2e::TinyLab(100, 0));
  e2e::WriteText(folder_ / "plan.toml", e2e::TinyPlan(4, 3));
  const Outcome capture =
      e2e::RunLuxfield({"capture", "plan.toml", "s", "--lab", "lab.toml"}, folder_);
  ASSERT_EQ(capture.exit_code, 0) << capture.err;
  const std::string journal = e2e::ReadText(folder_ / "s" / "journal.jsonl");
  const std::vector<std::string> words{"s", "--size", "700x500"};
  ViewWith(words, [&](const std::string& window) {
    Hand({"mousemove", "--window", window, "690", "490"});
  });
  const cv::Mat before = shown_.clone();
  ViewWith(words, [&](const std::string& window) {
    Hand({"mousemove", "--window", window, "150", "250"});
  });
  cv::Mat apart;
  cv::absdiff(shown_, before, apart);
  EXPECT_GT(cv::countNonZero(apart.reshape(1)), 500);  // the tooltip's letters
  EXPECT_EQ(e2e::ReadText(folder_ / "s" / "journal.jsonl"), journal);
  EXPECT_EQ(e2e::RunLuxfield({"verify", "s"}, folder_).exit_code, 0);
}

// Closed while its tables are still built.
TEST_F(InteractionTest, AWindowThatIsClosedAtOnceEnds) {
  auto view = std::async(std::launch::async, [&] {
    return e2e::RunLuxfield({"view", "scene.toml", "--size", "300x200", "--error", "0.1%"},
                            folder_);
  });
  Hand({"search", "--sync", "--onlyvisible", "--name", "luxfield", "windowfocus", "--sync"});
  Press("ctrl+q");  // to whichever window has the focus: this one may be gone when the key comes up
  const Outcome outcome = view.get();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

// A window with changes asks before it closes, and Esc stays.
TEST_F(InteractionTest, ChangesAreNotLostWithTheWindow) {
  auto view = std::async(std::launch::async, [&] {
    return e2e::RunLuxfield({"view", "scene.toml", "--size", "640x400", "--error", "20%"}, folder_);
  });
  FindWindow();
  WaitUntilItIsLit();
  for (const char* key : {"ctrl+d", "ctrl+q", "Escape", "ctrl+s", "ctrl+q"}) Press(key);
  const Outcome outcome = view.get();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(scene::ReadScene(folder_ / "scene.toml").luminaires.size(), 2);
}

TEST_F(InteractionTest, AWindowThatIsResizedToNothingComesBack) {
  ViewWith([&](const std::string& window) {
    Hand({"windowsize", window, "1", "1"});
    Hand({"windowsize", window, "3", "50"});
    Hand({"windowsize", window, "500", "300"});
  });
  EXPECT_EQ(shown_.size(), cv::Size(500, 300));
}

// A device that is gone is a sentence in the place of the picture that it lit.
TEST_F(InteractionTest, ALostDeviceIsASentence) {
  ViewWith([&](const std::string&) { WaitUntilItIsLit(); });
  const cv::Mat lit = shown_.clone();
  setenv("LD_PRELOAD", e2e::BuiltProgram("lost_device.so").c_str(), 1);
  setenv("LUXFIELD_DEVICE_IS_LOST", (folder_ / "lost").c_str(), 1);
  ViewWith(
      {"scene.toml", "--size", "640x400", "--error", "20%"},
      [&](const std::string& window) {
        unsetenv("LD_PRELOAD");
        WaitUntilItIsLit();
        e2e::WriteText(folder_ / "lost", "");
        Hand({"mousemove", "--window", window, "200", "150", "click", "4"});
      },
      3);
  unsetenv("LUXFIELD_DEVICE_IS_LOST");
  EXPECT_THAT(outcome_.err, testing::HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
  ASSERT_EQ(shown_.size(), lit.size());
  const cv::Rect middle(100, 100, 120, 200);
  EXPECT_LT(cv::mean(shown_(middle))[1], 0.5 * cv::mean(lit(middle))[1]);
  EXPECT_GT(cv::countNonZero(shown_.reshape(1) > 150), 300);  // letters on the dark ground
}

}  // namespace
}  // namespace luxfield::view
