#include "luxfield/view/documents/lamps_panel.h"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "luxfield/core/printable.h"
#include "luxfield/view/documents/fields.h"
#include "luxfield/view/window/keys.h"

namespace luxfield::view {
namespace {

constexpr double kLargest_m = 1e6, kBrightest = 1e12;
constexpr float kStep_m = 0.01f, kStep_deg = 0.25f;
constexpr double kBeside = 0.12;  // of the picture's height: where a copy stands

}  // namespace

bool LampsPanel::DrawNumbers(SceneEditor& editor) {
  LampPlacement lamp = editor.lamps()[chosen_];
  Fields fields(editor);
  fields.Drag("position", lamp.position, kStep_m, kLargest_m, "%.3f",
              lamp.IsClassical() ? "metres: the middle of the light"
                                 : "metres: the middle of the filter plane");
  if (lamp.look_at)
    fields.Drag("looks at", *lamp.look_at, kStep_m, kLargest_m, "%.3f",
                "metres: where its axis goes");
  else
    fields.Drag("turned by", lamp.rotate_deg, kStep_deg, kLargest_m, "%.2f",
                "degrees about the world's x axis, then y, then z");
  fields.Factor("scale", lamp.scale, kBrightest, "multiplies its light");
  fields.Tint("colour", lamp.colour, kBrightest,
              "factors of its light's red, green and blue, linear; 1 1 1 as it was measured");
  const bool changed = fields.changed() && editor.Set(chosen_, lamp);
  fields.End();
  return changed;
}

bool LampsPanel::DrawSwitch(SceneEditor& editor) {
  LampPlacement lamp = editor.lamps()[chosen_];
  bool on = lamp.scale > 0;
  if (!ImGui::Checkbox("on", &on)) return false;
  if (!on) switched_on_ = lamp.scale;
  lamp.scale = on ? switched_on_ : 0;
  editor.Begin();
  editor.Set(chosen_, lamp);
  editor.End();
  return true;
}

// Its light field: one that lies near, or any whose path is typed.
bool LampsPanel::DrawFile(SceneEditor& editor) {
  if (editor.lamps()[chosen_].IsClassical()) {
    DrawDistribution(editor.lamps()[chosen_]);
    return false;
  }
  const std::string now = editor.lamps()[chosen_].file;
  const std::string shown = core::OnOneLine(std::filesystem::path(now).filename().string());
  std::string wanted = now;
  if (ImGui::BeginCombo("light field", shown.c_str(), ImGuiComboFlags_HeightLarge)) {
    for (const std::string& name : LightFieldsNear(editor))
      if (ImGui::Selectable(core::OnOneLine(name).c_str(), name == now)) wanted = name;
    ImGui::Separator();
    if (ImGui::InputTextWithHint("##path", "a path, then Enter", &typed_file_,
                                 ImGuiInputTextFlags_EnterReturnsTrue)) {
      wanted = typed_file_;
      ImGui::CloseCurrentPopup();
    }
    ImGui::EndCombo();
  }
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(
        "exchanges the lamp for another .lf.exr, where it stands;\n"
        "paths are relative to the scene");
  if (wanted == now || wanted.empty()) return false;
  editor.Exchange(chosen_, wanted);
  return true;
}

void LampsPanel::DrawDistribution(const LampPlacement& lamp) {
  const std::string name = std::filesystem::path(lamp.distribution).filename().string();
  ImGui::TextDisabled("%s light of %s", lamp.model.c_str(), core::OnOneLine(name).c_str());
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(
        "a classical light has no light field to exchange;\n"
        "change its distribution, model and size in the scene's file");
}

bool LampsPanel::DrawMirror(SceneEditor& editor) {
  constexpr const char* kNames[] = {"x", "y", "z"};
  if (!ImGui::BeginPopup("mirror")) return false;
  ImGui::TextUnformatted("in a plane of constant");
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    ImGui::SameLine();
    if (ImGui::RadioButton(kNames[static_cast<int>(axis)], axis == mirror_)) mirror_ = axis;
  }
  ImGui::InputDouble("m", &mirror_at_m_, 0, 0, "%.3f");
  ImGui::TextDisabled("Its place and its axis; what it sends out\nis measured and stays as it is.");
  const bool mirror = ImGui::Button("Mirror");
  if (mirror) {
    editor.Begin();
    editor.Set(chosen_, Mirrored(editor.lamps()[chosen_], mirror_, mirror_at_m_));
    editor.End();
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
  return mirror;
}

void LampsPanel::Duplicate(const scene::Camera& camera, SceneEditor& editor) {
  const lightfield::Vec3 from = editor.lamps()[chosen_].position,
                         beside = kBeside * std::abs(HeightAt(camera, from)) * camera.right;
  editor.Duplicate(chosen_,
                   {InMillimetres(beside.x), InMillimetres(beside.y), InMillimetres(beside.z)});
  chosen_ = editor.lamps().size() - 1;
}

bool LampsPanel::DrawActions(const scene::Camera& camera, SceneEditor& editor) {
  bool changed = false;
  const bool duplicate = ImGui::Button("Duplicate");
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("another of the same beside it (Ctrl and D)");
  ImGui::SameLine();
  if (ImGui::Button("Mirror ...")) ImGui::OpenPopup("mirror");
  changed |= DrawMirror(editor);
  ImGui::SameLine();
  if (ImGui::Button("Remove") && editor.lamps().size() > 1) changed |= editor.Remove(chosen_);
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(editor.lamps().size() > 1 ? "from the scene" : "the last lamp stays");
  chosen_ = std::min(chosen_, editor.lamps().size() - 1);
  if (duplicate) Duplicate(camera, editor);
  return changed || duplicate;
}

bool LampsPanel::Draw(const scene::Camera& camera, SceneEditor& editor) {
  const ImGuiIO& io = ImGui::GetIO();
  const auto pressed = [&](Key key) {
    return !io.WantTextInput && ImGui::IsKeyPressed(key, false);
  };
  if (pressed(key::kG) && !io.KeyCtrl) handles_ = !handles_;
  if (editor.lamps().empty()) return false;
  chosen_ = std::min(chosen_, editor.lamps().size() - 1);
  const bool duplicate = io.KeyCtrl && pressed(key::kD);
  if (duplicate) Duplicate(camera, editor);
  if (!ImGui::CollapsingHeader("Lamps", ImGuiTreeNodeFlags_DefaultOpen)) return duplicate;
  for (std::size_t i = 0; i < editor.lamps().size(); ++i) {
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::Selectable(core::OnOneLine(editor.lamps()[i].name).c_str(), i == chosen_))
      chosen_ = i;
    ImGui::PopID();
  }
  bool changed = duplicate;
  changed |= DrawNumbers(editor);
  changed |= DrawSwitch(editor);
  ImGui::SameLine();
  ImGui::Checkbox("handles in the picture", &handles_);
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("arrows move the lamp, the ring aims it, dots choose another (G)");
  changed |= DrawFile(editor);
  changed |= DrawActions(camera, editor);
  return changed;
}

}  // namespace luxfield::view
