// Scenes and stages whose files others write while they are shown.
#include "luxfield/view/documents/scene_document.h"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "luxfield/view/picture/look.h"
#include "tests/e2e/program.h"
#include "tests/view/scene_file.h"
#include "tests/view/virtual_display.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double kError = 0.02;  // of a pixel
// Of the ratio of two pictures' mean luminances, if all pixels of each had the same error.
constexpr double kRatioError = 2 * kError;

class SceneDocumentTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = e2e::FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name());
    if (auto display = VirtualDisplay::Start()) display_.emplace(std::move(*display));
    if (!display_) GTEST_SKIP() << "SKIPPED: Xvfb is missing: no scene in a window is tested";
    window_.emplace("scene", WindowSize{64, 64});
    WriteSceneFile(folder_);
  }
  void TearDown() override {
    document_.reset();
    window_.reset();
    fs::remove_all(folder_);
  }

  void Open(const std::string& file, SceneKind kind) {
    SceneOptions options;
    options.file = folder_ / file;
    options.width = 48;
    options.height = 36;
    options.error = kError;
    document_ = OpenScene(options, kind);
    Settle();
  }
  // Whether it comes to that state.
  bool Reaches(bool settled) const {
    for (int i = 0; i < 120000; ++i, std::this_thread::sleep_for(1ms)) {
      document_->Update();
      if (document_->Settled() == settled) return true;
    }
    return false;
  }
  void Settle() const {
    ASSERT_TRUE(Reaches(true)) << document_->Status();
    ASSERT_FALSE(document_->failure()) << document_->failure()->sentence;
    ASSERT_TRUE(document_->picture());
  }
  // Writes bytes, and lets the document find and read them.
  void Rewrite(const std::string& file, const std::string& bytes) const {
    const auto before = fs::last_write_time(folder_ / file);
    e2e::WriteText(folder_ / file, bytes);
    fs::last_write_time(folder_ / file, before + 10s);
    ASSERT_TRUE(Reaches(false));
    Settle();
  }
  double Mean() const { return MeanLuminance(document_->picture()->radiance); }
  std::string LampOfTwice() const {
    lightfield::LightField lamp = lightfield::ReadLightField(folder_ / "lamp.lf.exr");
    for (float& value : lamp.data) value *= 2;
    lightfield::WriteLightField(folder_ / "twice.lf.exr", lamp);
    return e2e::ReadText(folder_ / "twice.lf.exr");
  }

  fs::path folder_;
  std::optional<VirtualDisplay> display_;
  std::optional<Window> window_;
  std::unique_ptr<Document> document_;
};

// The picture before stays where a file is half written, and the whole one is shown.
TEST_F(SceneDocumentTest, ALampThatIsHalfWrittenLeavesThePicture) {
  Open("scene.toml", SceneKind::kScene);
  const double before = Mean();
  const std::string twice = LampOfTwice();
  Rewrite("lamp.lf.exr", twice.substr(0, twice.size() / 2));
  EXPECT_NEAR(Mean() / before, 1, kRatioError);
  Rewrite("lamp.lf.exr", twice);
  EXPECT_NEAR(Mean() / before, 2, 2 * kRatioError);
}

TEST_F(SceneDocumentTest, ALightFieldThatIsHalfWrittenLeavesItsStage) {
  Open("lamp.lf.exr", SceneKind::kStage);
  const double before = Mean();
  const std::string twice = LampOfTwice();
  Rewrite("lamp.lf.exr", twice.substr(0, twice.size() / 2));
  EXPECT_NEAR(Mean() / before, 1, kRatioError);
  Rewrite("lamp.lf.exr", twice);
  EXPECT_NEAR(Mean() / before, 2, 2 * kRatioError);
}

TEST_F(SceneDocumentTest, ASceneThatIsHalfWrittenLeavesThePicture) {
  Open("scene.toml", SceneKind::kScene);
  const double before = Mean();
  std::string text = e2e::ReadText(folder_ / "scene.toml");
  Rewrite("scene.toml", text.substr(0, text.find("[[luminaire]]") + 30));
  EXPECT_NEAR(Mean() / before, 1, kRatioError);
  text += "scale = 2\n";
  Rewrite("scene.toml", text);
  EXPECT_NEAR(Mean() / before, 2, 2 * kRatioError);
}

// A texture's white becomes sRGB code 128, which is 0.2159 (IEC 61966-2-1).
TEST_F(SceneDocumentTest, ATextureThatIsWrittenIsShown) {
  const auto png = [](int code) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", cv::Mat(2, 2, CV_8UC3, cv::Scalar::all(code)), bytes);
    return std::string(bytes.begin(), bytes.end());
  };
  e2e::WriteText(folder_ / "paint.png", png(255));
  std::string text = kSceneText;
  const std::string albedo = "albedo = [0.5, 0.4, 0.3]\n";
  text.insert(text.find(albedo) + albedo.size(), "texture = \"paint.png\"\n");
  e2e::WriteText(folder_ / "scene.toml", text);
  Open("scene.toml", SceneKind::kScene);
  const double before = Mean();
  Rewrite("paint.png", png(128));
  EXPECT_NEAR(Mean() / before, 0.2159, 0.2159 * kRatioError);
}

}  // namespace
}  // namespace luxfield::view
