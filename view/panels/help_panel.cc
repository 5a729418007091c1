#include "luxfield/view/panels/help_panel.h"

#include <imgui.h>

#include <algorithm>

namespace luxfield::view {
namespace {

constexpr float kWidth = 21;  // in heights of a letter, as the side panel's

struct Line {
  const char *hand, *does;
};

constexpr Line kMouse[] = {
    {"left button", "turn the camera about what the picture's middle showed first"},
    {"right button, or Shift and left", "shift the camera across the view"},
    {"middle button, or Ctrl and left", "look around"},
    {"wheel", "nearer, farther"},
    {"pointer on the picture", "its value stands in the last line"},
    {"double click", "keep a probe there, two of them a profile; Del removes them"},
};
constexpr Line kKeys[] = {
    {"W S A D", "fly forwards, back, left, right; with Shift four times as fast"},
    {"E Q", "fly up, down"},
    {"R", "the camera as in the file"},
    {"1 2 3", "exponential, linear, false colour"},
    {"4 5", "exponential and filmic, with the hue kept"},
    {"L", "lines of equal value in false colour"},
    {"+ -", "exposure by a third of a stop"},
    {"G", "handles on the lamps, and without"},
    {"H", "the picture alone, and back"},
    {"F1", "this help"},
    {"Ctrl and D", "another lamp of the same"},
    {"Ctrl and Z, Y, S", "undo, do again, save the scene"},
    {"Esc", "leave a list, a field or this help, else the window"},
    {"Ctrl and Q", "close the window"},
};

template <int N>
void DrawLines(const char* name, const Line (&lines)[N]) {
  if (!ImGui::BeginTable(name, 2, ImGuiTableFlags_RowBg)) return;
  ImGui::TableSetupColumn("hand", ImGuiTableColumnFlags_WidthStretch, 2);
  ImGui::TableSetupColumn("does", ImGuiTableColumnFlags_WidthStretch, 3);
  for (const Line& line : lines) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextWrapped("%s", line.hand);
    ImGui::TableNextColumn();
    ImGui::TextWrapped("%s", line.does);
  }
  ImGui::EndTable();
}

}  // namespace

void DrawHelp(bool& open) {
  if (!open) return;
  // Over the side panel, so that the picture that the keys act on stays in sight.
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float width = std::min(kWidth * ImGui::GetFontSize(), 0.5f * size.x);
  ImGui::SetNextWindowPos(ImVec2(size.x - width, 0));
  ImGui::SetNextWindowSize(ImVec2(width, size.y - 2 * ImGui::GetFrameHeight()));
  constexpr ImGuiWindowFlags kFlags = ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                                      ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoSavedSettings;
  ImGui::SetNextWindowBgAlpha(1);
  if (ImGui::Begin("Keys and mouse", &open, kFlags)) {
    DrawLines("mouse", kMouse);
    ImGui::Separator();
    DrawLines("keys", kKeys);
  }
  ImGui::End();
}

}  // namespace luxfield::view
