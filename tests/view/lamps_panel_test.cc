// Panels of a scene under a mouse and keys, drawn into nothing.
#include "luxfield/view/documents/lamps_panel.h"

#include <gtest/gtest.h>
#include <imgui.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <vector>

#include "luxfield/view/documents/scene_panel.h"
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
    scene_ = scene::ReadScene(file_);
    editor_.emplace(scene_);
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
    bool changed = history_.DrawHistory(*editor_);
    changed |= panel_.Draw(scene_.camera, *editor_);
    ImGui::End();
    ImGui::Render();
    return changed;
  }
  // Frames with a change while the button goes down and up.
  int Click(float x, float y) {
    ImGuiIO& io = ImGui::GetIO();
    int changes = 0;
    for (const bool down : {false, false, true, true, false, false, false}) {
      io.MousePos = {x, y};
      io.MouseDown[0] = down;
      changes += Draw();
    }
    return changes;
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
    for (const bool down : {false, false, true, true}) frame(40, down);
    for (float x = 50; x <= 90; x += 10) frame(x, true);
    for (int k = 0; k < 3; ++k) frame(90, false);
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
  scene::Scene scene_;
  std::optional<SceneEditor> editor_;
  ScenePanel history_;
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

// By the number of its red, and by its swatch: a click into the square of saturation and value makes
// white a red whose largest factor is as large.
TEST_F(LampsPanelTest, TheColourIsDraggedAndChosen) {
  const std::array<double, 3> white = {1, 1, 1};
  float row = 5;
  while (row < kHeight && Lamp().colour == white) Drag(row += 10);
  const std::array<double, 3> dragged = Lamp().colour;
  EXPECT_GT(dragged[0], 1.05);
  EXPECT_EQ(dragged[1], 1);
  EXPECT_EQ(dragged[2], 1);
  PressWithControl(key::kZ);
  ASSERT_EQ(Lamp().colour, white);
  EXPECT_EQ(Click(17, row), 0);
  EXPECT_GT(Click(90, row + 40), 0);
  const std::array<double, 3> chosen = Lamp().colour;
  EXPECT_EQ(chosen[0], 1);
  EXPECT_LT(chosen[1], 0.95);
  EXPECT_EQ(chosen[2], chosen[1]);
  PressWithControl(key::kZ);
  EXPECT_EQ(Lamp().colour, white);
}

TEST_F(LampsPanelTest, ControlAndSSavesIntoTheScene) {
  DragPosition();
  ASSERT_TRUE(editor_->changed());
  PressWithControl(key::kS);
  EXPECT_FALSE(editor_->changed());
  EXPECT_EQ(ReadSceneEdits(file_).lamps.at(0).position.x, Lamp().position.x);
}

TEST_F(LampsPanelTest, ControlAndDCopiesTheLampBesideIt) {
  Draw();
  PressWithControl(key::kD);
  ASSERT_EQ(editor_->lamps().size(), 2);
  const LampPlacement &first = editor_->lamps()[0], &copy = editor_->lamps()[1];
  EXPECT_EQ(copy.name, "luminaire 1 2");
  EXPECT_EQ(copy.file, first.file);
  const Vec3 beside = copy.position - first.position;
  EXPECT_GT(lightfield::Dot(beside, scene_.camera.right), 0.05);
  EXPECT_LT(lightfield::Length(*copy.look_at - *first.look_at - beside), 1e-12);
  // Whole millimetres, as a hand would write them.
  for (const double offset : {beside.x, beside.y, beside.z})
    EXPECT_NEAR(1e3 * offset, std::round(1e3 * offset), 1e-9);
  EXPECT_EQ(panel_.chosen(), 1);
  PressWithControl(key::kZ);
  EXPECT_EQ(editor_->lamps().size(), 1);
  EXPECT_EQ(panel_.chosen(), 0);
}

// A scene may be named without its folder.
TEST_F(LampsPanelTest, LightFieldsLieBesideTheSceneHoweverItIsNamed) {
  const fs::path folder = fs::path(testing::TempDir()) / ("near_" + std::to_string(getpid())),
                 before = fs::current_path();
  fs::create_directories(folder / "lamps");
  for (const char* name : {"a.lf.exr", "b.lf.exr", "b.exr", "lamps/c.lf.exr"})
    std::ofstream(folder / name) << "x";
  std::ofstream(folder / "s.toml") << kScene << "[[luminaire]]\nfile = \"lamps/c.lf.exr\"\n"
                                   << "position = [0, 0, 1]\nlook_at = [0, 5, 0]\n";
  const std::set<std::string> all{"a.lf.exr", "b.lf.exr", "lamps/c.lf.exr"};
  EXPECT_EQ(LightFieldsNear(SceneEditor(scene::ReadScene(folder / "s.toml"))), all);
  fs::current_path(folder);
  EXPECT_EQ(LightFieldsNear(SceneEditor(scene::ReadScene("s.toml"))), all);
  fs::current_path(before);
  fs::remove_all(folder);
}

// A share of what it is, so that a light of 10^-5 is dimmed as one of 10^5 is.
TEST_F(LampsPanelTest, TheScaleIsDraggedByShares) {
  std::vector<double> shares;
  for (const double scale : {1e-5, 1e5}) {
    LampPlacement lamp = Lamp();
    lamp.scale = scale;
    editor_->Set(0, lamp);
    for (float y = 5; y < kHeight && Lamp().scale == scale; y += 10) Drag(y);
    shares.push_back(Lamp().scale / scale);
  }
  EXPECT_GT(shares[0], 1.05);
  EXPECT_LT(shares[0], 2);
  EXPECT_NEAR(shares[0], shares[1], 0.01);
}

}  // namespace
}  // namespace luxfield::view
