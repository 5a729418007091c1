#include "luxfield/view/documents/scene_panel.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <utility>

#include "luxfield/core/printable.h"
#include "luxfield/view/documents/fields.h"
#include "luxfield/view/lighting/failure.h"
#include "luxfield/view/window/keys.h"

namespace luxfield::view {
namespace {

using scene::MaterialKind;

constexpr double kBrightest = 1e12, kSharpest = 1e6, kTurn_deg = 360;

// A button that is grey where it would do nothing.
bool ButtonIf(bool possible, const char* name) {
  ImGui::BeginDisabled(!possible);
  const bool pressed = ImGui::Button(name);
  ImGui::EndDisabled();
  return pressed;
}

std::string FreeName(const std::vector<SavedView>& views) {
  for (std::size_t number = views.size() + 1;; ++number) {
    std::string name = fmt::format("view {}", number);
    if (std::ranges::find(views, name, &SavedView::name) == views.end()) return name;
  }
}

}  // namespace

bool ScenePanel::Save(SceneEditor& editor) {
  try {
    editor.Save();
    said_ = "saved";
    return true;
  } catch (const std::exception&) {
    said_ = CurrentFailure().sentence;
    return false;
  }
}

void ScenePanel::DrawSaid() const {
  if (!said_.empty()) ImGui::TextWrapped("%s", core::OnOneLine(said_).c_str());
}

bool ScenePanel::DrawHistory(SceneEditor& editor) {
  const ImGuiIO& io = ImGui::GetIO();
  const auto with_control = [&](Key pressed) {
    return io.KeyCtrl && !io.WantTextInput && ImGui::IsKeyPressed(pressed, false);
  };
  bool undo = with_control(key::kZ), redo = with_control(key::kY), save = with_control(key::kS);
  undo |= ButtonIf(editor.CanUndo(), "Undo");
  ImGui::SameLine();
  redo |= ButtonIf(editor.CanRedo(), "Redo");
  ImGui::SameLine();
  save |= ButtonIf(editor.changed(), "Save");
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("into scene.toml, whose comments stay (Ctrl and S)");
  if (editor.changed()) {
    ImGui::SameLine();
    ImGui::TextDisabled("not saved");
    if (said_ == "saved") said_.clear();
  }
  DrawSaid();
  const bool undone = undo && editor.CanUndo(), redone = redo && editor.CanRedo();
  if (undone) editor.Undo();
  if (redone) editor.Redo();
  if (undone || redone) said_.clear();
  if (save) Save(editor);
  return undone || redone;
}

bool ScenePanel::DrawEnvironment(SceneEditor& editor) {
  if (!editor.edits().environment || !ImGui::CollapsingHeader("Environment")) return false;
  EnvironmentNumbers numbers = *editor.edits().environment;
  ImGui::PushID("environment");
  Fields fields(editor);
  fields.Drag("turned by", numbers.rotate_deg, 0.5f, kTurn_deg, "%.1f",
              "degrees about the world's x axis, then y, then z; the last turns the sky");
  fields.Factor("scale", numbers.scale, kBrightest, "multiplies its radiance");
  if (fields.changed()) editor.Set(numbers);
  fields.End();
  ImGui::PopID();
  return fields.changed();
}

bool ScenePanel::DrawMaterials(SceneEditor& editor) {
  const auto& materials = editor.edits().materials;
  if (materials.empty() || !ImGui::CollapsingHeader("Materials")) return false;
  material_ = std::min(material_, materials.size() - 1);
  ImGui::PushID("materials");
  if (ImGui::BeginCombo("of", core::OnOneLine(materials[material_].name).c_str())) {
    for (std::size_t i = 0; i < materials.size(); ++i)
      if (ImGui::Selectable(core::OnOneLine(materials[i].name).c_str(), i == material_))
        material_ = i;
    ImGui::EndCombo();
  }
  MaterialNumbers numbers = materials[material_];
  Fields fields(editor);
  fields.Colour("albedo", numbers.albedo, "reflectance of red, green and blue, linear, 0 to 1");
  if (numbers.kind == MaterialKind::kPhong) {
    fields.Colour("specular", numbers.specular, "what the lobe reflects at most, linear, 0 to 1");
    fields.Drag("exponent", numbers.exponent, 1, 0, kSharpest, "%.4g", "of the lobe's cosine");
    // More light than arrives is reflected by nothing.
    for (std::size_t c = 0; c < 3; ++c)
      numbers.specular[c] = std::min(numbers.specular[c], 1 - numbers.albedo[c]);
  }
  if (numbers.kind == MaterialKind::kGgx) {
    fields.Drag("metallic", numbers.metallic, 0.005f, 0, 1, "%.3f", "0: a dielectric, 1: a metal");
    fields.Drag("roughness", numbers.roughness, 0.005f, 0, 1, "%.3f", "its square is alpha");
  }
  if (fields.changed()) editor.Set(material_, numbers);
  fields.End();
  ImGui::PopID();
  return fields.changed();
}

std::optional<SavedView> ScenePanel::DrawViews(const CameraControl& camera, SceneEditor& editor) {
  std::optional<SavedView> chosen;
  std::optional<std::size_t> dropped;
  const auto& views = editor.edits().views;
  for (std::size_t i = 0; i < views.size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    const std::string name = core::OnOneLine(views[i].name);
    const ImGuiStyle& style = ImGui::GetStyle();
    const float forget = ImGui::CalcTextSize("x").x + 2 * style.FramePadding.x,
                room = ImGui::GetContentRegionAvail().x - forget - style.ItemSpacing.x,
                wanted = ImGui::CalcTextSize(name.c_str()).x + 2 * style.FramePadding.x;
    if (ImGui::Button(name.c_str(), ImVec2(std::min(wanted, room), 0))) chosen = views[i];
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("look from there: %s", name.c_str());
    ImGui::SameLine();
    if (ImGui::SmallButton("x")) dropped = i;
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("forget this view");
    ImGui::PopID();
  }
  if (dropped) editor.DropView(*dropped);
  ImGui::InputTextWithHint("##name", FreeName(views).c_str(), &view_name_);
  ImGui::SameLine();
  if (ImGui::Button("Keep view")) {
    editor.Keep(ViewFrom(camera.camera(), camera.pivot_m(),
                         view_name_.empty() ? FreeName(views) : view_name_));
    view_name_.clear();
  }
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("a [[view]] of that name, written when the scene is saved");
  return chosen;
}

}  // namespace luxfield::view
