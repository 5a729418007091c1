// The lamps' panel under a mouse and keys, drawn into nothing.
#include "luxfield/view/documents/lamps_panel.h"

#include <gtest/gtest.h>
#include <imgui.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "luxfield/view/window/keys.h"

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;
using lightfield::Vec3;

constexpr char kScene[] = R"([camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.2]
[[material]]
name = "grey"
albedo = [0.5, 0.4, 0.3]
[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 8, 0]
material = "grey"
[[luminaire]]
file = "a.lf.exr"
position = [0.5, 0.25, 0.75]
look_at = [0, 5, 0.3]
)";
constexpr float kWidth = 400, kHeight = 400;

class LampsPanelTest : public testing::Test {
 protected:
  LampsPanelTest()
      : file_(fs::path(testing::TempDir()) /
              ("luxfield_panel_" + std::to_string(getpid()) + ".toml")) {
    std::ofstream(file_) << kScene;
    editor_.emplace(file_);
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {kWidth, kHeight};
    io.DeltaTime = 0.02f;
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
  }
  ~LampsPanelTest() override {
    ImGui::DestroyContext();
    fs::remove(file_);
  }

  // What the panel says of a change.
  bool Draw() {
    ImGui::NewFrame();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({kWidth, kHeight});
    ImGui::Begin("lamps", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
    const bool changed = panel_.Draw(*editor_);
    ImGui::End();
    ImGui::Render();
    return changed;
  }
  // Frames with a change while the mouse goes to the right with its button down.
  int Drag(float y) {
    ImGuiIO& io = ImGui::GetIO();
    int changes = 0;
    const auto frame = [&](float x, bool down) {
      io.MousePos = {x, y};
      io.MouseDown[0] = down;
      changes += Draw();
    };
    for (const bool down : {false, false, true, true}) frame(30, down);
    for (float x = 40; x <= 80; x += 10) frame(x, true);
    for (int k = 0; k < 3; ++k) frame(80, false);
    return changes;
  }
  void PressWithControl(Key letter) {
    ImGuiIO& io = ImGui::GetIO();
    for (const bool down : {true, false}) {
#if IMGUI_VERSION_NUM >= 18700
      io.AddKeyEvent(ImGuiMod_Ctrl, down);
      io.AddKeyEvent(letter, down);
#else
      io.KeyCtrl = down;
      io.KeysDown[letter] = down;
#endif
      Draw();
    }
  }
  const LampPlacement& Lamp() const { return editor_->lamps()[0]; }

  // Drags the first field that moves the lamp, from above; how many frames changed it.
  int DragPosition() {
    for (float y = 5; y < kHeight; y += 10)
      if (const int changes = Drag(y); changes > 0) return changes;
    ADD_FAILURE() << "no field can be dragged";
    return 0;
  }

  const fs::path file_;
  std::optional<LampEditor> editor_;
  LampsPanel panel_;
};

TEST_F(LampsPanelTest, ADragMovesTheLampAndIsOneStepToUndo) {
  const Vec3 before = Lamp().position;
  EXPECT_FALSE(Draw());
  EXPECT_GT(DragPosition(), 2);
  const Vec3 after = Lamp().position;
  EXPECT_GT(after.x, before.x + 0.2);
  EXPECT_LT(after.x, before.x + 0.8);
  EXPECT_EQ(after.y, before.y);
  EXPECT_EQ(after.z, before.z);
  ASSERT_TRUE(editor_->CanUndo());
  PressWithControl(key::kZ);
  EXPECT_EQ(Lamp().position.x, before.x);
  EXPECT_FALSE(editor_->CanUndo());
  PressWithControl(key::kY);
  EXPECT_EQ(Lamp().position.x, after.x);
}

TEST_F(LampsPanelTest, ControlAndSSavesIntoTheScene) {
  DragPosition();
  ASSERT_TRUE(editor_->changed());
  PressWithControl(key::kS);
  EXPECT_FALSE(editor_->changed());
  EXPECT_EQ(ReadPlacements(file_).at(0).position.x, Lamp().position.x);
}

}  // namespace
}  // namespace luxfield::view
