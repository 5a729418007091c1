// Hands on the window: keys and mouse by xdotool, on a virtual display.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "luxfield/core/json.h"
#include "luxfield/scene/scene.h"
#include "luxfield/view/scene_file/lamp_handles.h"
#include "tests/e2e/program.h"
#include "tests/view/scene_file.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using e2e::Outcome;

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
  // As long as a finger takes.
  static void Hold() { std::this_thread::sleep_for(std::chrono::milliseconds(250)); }
  void Press(const std::string& key) const {
    Hand({"keydown", key});
    Hold();
    Hand({"keyup", key});
    Hold();
  }

  // Opens the scene, and closes it when it shows what it is to show.
  void ViewUntilSettled() {
    const Outcome outcome =
        e2e::RunLuxfield({"view", "scene.toml", "--screenshot", "s.png", "--size", "640x400",
                          "--json", "v.json", "--read", "80,60", "--error", "20%"},
                         folder_);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    json_ = core::ReadJson(folder_ / "v.json");
  }

  // Opens the scene, lets `hands` do something with the window of that number, and closes it.
  void ViewWith(const std::function<void(const std::string& window)>& hands) {
    auto view = std::async(std::launch::async, [this] {
      return e2e::RunLuxfield(
          {"view", "scene.toml", "--screenshot", "s.png", "--frames", "1000000", "--size",
           "640x400", "--json", "v.json", "--read", "80,60", "--error", "20%"},
          folder_);
    });
    fs::create_directories(folder_ / "hand");
    const Outcome found = e2e::RunProgram(
        {"xdotool", "search", "--sync", "--onlyvisible", "--name", "luxfield"}, folder_ / "hand");
    const std::string window = found.out.substr(0, found.out.find('\n'));
    Hand({"windowfocus", "--sync", window});
    Hold();
    hands(window);
    // Until it has seen it: the first frames may wait for kernels to be built.
    while (view.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      e2e::RunProgram({"xdotool", "keydown", "ctrl", "keydown", "q"}, folder_ / "hand");
      Hold();
      e2e::RunProgram({"xdotool", "keyup", "q", "keyup", "ctrl"}, folder_ / "hand");
    }
    const Outcome outcome = view.get();
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    shown_ = cv::imread((folder_ / "s.png").string());
    json_ = core::ReadJson(folder_ / "v.json");
  }

  static std::optional<VirtualDisplay> display_;
  fs::path folder_;
  cv::Mat shown_;
  core::Json json_;
};
std::optional<VirtualDisplay> InteractionTest::display_;

// The share of pixels that are coloured, in the left of the window, where the picture is.
double Coloured(const cv::Mat& shown) {
  int coloured = 0;
  for (int row = 0; row < shown.rows; ++row)
    for (int column = 0; column < shown.cols / 2; ++column) {
      const auto pixel = shown.at<cv::Vec3b>(row, column);
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
  EXPECT_GT(cv::countNonZero(apart.reshape(1)), shown_.rows * shown_.cols / 10);
}

TEST_F(InteractionTest, ADragTurnsTheCamera) {
  ViewUntilSettled();
  const core::Json before = json_["readings"][0];
  ViewWith([&](const std::string& window) {
    Hand({"mousemove", "--window", window, "150", "150", "mousedown", "1"});
    Hold();
    Hand({"mousemove_relative", "40", "0"});
    Hold();
    Hand({"mouseup", "1"});
    Hold();
  });
  const core::Json after = json_["readings"][0];
  ASSERT_TRUE(before.contains("position_m"));
  EXPECT_TRUE(!after.contains("position_m") || after["position_m"] != before["position_m"]);
}

// The arrow along x: the lamp goes where the pointer takes it, and the file says so after saving.
TEST_F(InteractionTest, AHandleMovesALampAndItIsSaved) {
  const scene::Camera camera = scene::ReadScene(folder_ / "scene.toml").camera;
  const LampPlacement before = ReadPlacements(folder_ / "scene.toml").at(0);
  const lightfield::Vec3 axis{1, 0, 0};
  const PicturePoint tip =
      *SeenAt(camera, before.position + 0.12 * HeightAt(camera, before.position) * axis);
  // The picture's pixels stand twice as large in the middle of what panel and bar leave.
  constexpr int kScale = 2, kLeft = 2, kTop = 58, kDrag = 36;
  const int column = kLeft + static_cast<int>(kScale * tip.column),
            row = kTop + static_cast<int>(kScale * tip.row);
  const std::string text = e2e::ReadText(folder_ / "scene.toml");
  ViewWith([&](const std::string& window) {
    // Until there is a picture, of which the first one needs tables, hands take hold of nothing.
    for (int i = 0; i < 60 && e2e::ReadText(folder_ / "scene.toml") == text; ++i) {
      Hand({"mousemove", "--window", window, std::to_string(column), std::to_string(row)});
      Hold();
      Hand({"mousedown", "1"});
      Hold();
      Hand({"mousemove_relative", std::to_string(kDrag), "0"});
      Hold();
      Hand({"mouseup", "1"});
      Hold();
      Hand({"keydown", "ctrl", "keydown", "s"});
      Hold();
      Hand({"keyup", "s", "keyup", "ctrl"});
      Hold();
    }
  });
  const LampPlacement after = ReadPlacements(folder_ / "scene.toml").at(0);
  const auto along = [&](double right) {
    return AlongAxis(camera, {tip.column + right / kScale, tip.row}, before.position, axis).value();
  };
  // The hand may have taken hold some pixels off.
  EXPECT_NEAR(after.position.x - before.position.x, along(kDrag) - along(0),
              0.25 * (along(kDrag) - along(0)));
  EXPECT_EQ(after.position.y, before.position.y);
  EXPECT_EQ(after.position.z, before.position.z);
  EXPECT_THAT(e2e::ReadText(folder_ / "scene.toml"), testing::HasSubstr("# A lamp over a floor."));
}

TEST_F(InteractionTest, AWindowThatIsResizedToNothingComesBack) {
  ViewWith([&](const std::string& window) {
    Hand({"windowsize", window, "1", "1"});
    Hold();
    Hand({"windowsize", window, "3", "50"});
    Hold();
    Hand({"windowsize", window, "500", "300"});
    Hold();
  });
  EXPECT_EQ(shown_.size(), cv::Size(500, 300));
}

}  // namespace
}  // namespace luxfield::view
