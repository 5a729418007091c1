#include "luxfield/view/documents/lamps_panel.h"

#include <imgui.h>

#include "luxfield/core/printable.h"
#include "luxfield/view/lighting/failure.h"
#include "luxfield/view/window/keys.h"

namespace luxfield::view {
namespace {

constexpr double kLargest_m = 1e6, kBrightest = 1e12;
constexpr float kStep_m = 0.01f, kStep_deg = 0.25f;

// Edits between taking hold of a field and letting go are one for undoing.
bool Group(LampEditor& editor, bool changed) {
  if (ImGui::IsItemActivated()) editor.Begin();
  return changed;
}

bool DragVector(LampEditor& editor, const char* name, lightfield::Vec3& v, float step,
                const char* format, const char* tip) {
  constexpr double kLow = -kLargest_m, kHigh = kLargest_m;
  double values[3] = {v.x, v.y, v.z};
  const bool changed = ImGui::DragScalarN(name, ImGuiDataType_Double, values, 3, step, &kLow,
                                          &kHigh, format, ImGuiSliderFlags_AlwaysClamp);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tip);
  if (changed) v = {values[0], values[1], values[2]};
  return Group(editor, changed);
}

}  // namespace

bool LampsPanel::DrawNumbers(LampEditor& editor) {
  LampPlacement lamp = editor.lamps()[chosen_];
  bool changed = false, ended = false;
  const auto field = [&](bool edited) {
    changed |= edited;
    ended |= ImGui::IsItemDeactivatedAfterEdit();
  };
  field(DragVector(editor, "position", lamp.position, kStep_m, "%.3f",
                   "metres: the middle of the filter plane"));
  if (lamp.look_at)
    field(DragVector(editor, "looks at", *lamp.look_at, kStep_m, "%.3f",
                     "metres: where its axis goes"));
  else
    field(DragVector(editor, "turned by", lamp.rotate_deg, kStep_deg, "%.2f",
                     "degrees about the world's x axis, then y, then z"));
  constexpr double kDark = 0, kBright = kBrightest;
  field(Group(editor, ImGui::DragScalar("scale", ImGuiDataType_Double, &lamp.scale, 0.005f, &kDark,
                                        &kBright, "%.4g", ImGuiSliderFlags_AlwaysClamp)));
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("multiplies its light");
  changed = changed && editor.Set(chosen_, lamp);
  if (ended) editor.End();
  return changed;
}

void LampsPanel::Save(LampEditor& editor) {
  try {
    editor.Save();
    said_ = "saved";
  } catch (const std::exception&) {
    said_ = CurrentFailure().sentence;
  }
}

bool LampsPanel::Draw(LampEditor& editor) {
  bool changed = false;
  const ImGuiIO& io = ImGui::GetIO();
  const auto with_control = [&](Key pressed) {
    return io.KeyCtrl && !io.WantTextInput && ImGui::IsKeyPressed(pressed, false);
  };
  if (!io.WantTextInput && ImGui::IsKeyPressed(key::kG, false)) handles_ = !handles_;
  bool undo = with_control(key::kZ), redo = with_control(key::kY), save = with_control(key::kS);
  if (ImGui::CollapsingHeader("Lamps", ImGuiTreeNodeFlags_DefaultOpen) && !editor.lamps().empty()) {
    for (std::size_t i = 0; i < editor.lamps().size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      if (ImGui::Selectable(core::OnOneLine(editor.lamps()[i].name).c_str(), i == chosen_))
        chosen_ = i;
      ImGui::PopID();
    }
    changed = DrawNumbers(editor);
    ImGui::Checkbox("handles in the picture", &handles_);
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("arrows move the lamp, the ring aims it, dots choose another (G)");
    undo |= ImGui::Button("Undo");
    ImGui::SameLine();
    redo |= ImGui::Button("Redo");
    ImGui::SameLine();
    save |= ImGui::Button("Save");
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("into scene.toml, whose comments stay (Ctrl and S)");
    if (editor.changed()) {
      ImGui::SameLine();
      ImGui::TextDisabled("not saved");
    }
    if (!said_.empty()) ImGui::TextWrapped("%s", core::OnOneLine(said_).c_str());
  }
  if (undo && editor.CanUndo()) {
    editor.Undo();
    changed = true;
  }
  if (redo && editor.CanRedo()) {
    editor.Redo();
    changed = true;
  }
  if (changed) said_.clear();
  if (save) Save(editor);
  return changed;
}

}  // namespace luxfield::view
