#include "luxfield/view/panels/help_panel.h"

#include <imgui.h>

namespace luxfield::view {
namespace {

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
    {"Ctrl and Z, Y, S", "undo, do again, save lamps"},
    {"Esc", "close this help, else the window"},
    {"Ctrl and Q", "close the window"},
};

template <int N>
void DrawLines(const char* name, const Line (&lines)[N]) {
  if (!ImGui::BeginTable(name, 2, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) return;
  for (const Line& line : lines) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(line.hand);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(line.does);
  }
  ImGui::EndTable();
}

}  // namespace

void DrawHelp(bool& open) {
  if (!open) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(0.5f * size.x, 0.5f * size.y), ImGuiCond_Always,
                          ImVec2(0.5f, 0.5f));
  constexpr ImGuiWindowFlags kFlags =
      ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove;
  if (ImGui::Begin("Keys and mouse", &open, kFlags)) {
    DrawLines("mouse", kMouse);
    ImGui::Separator();
    DrawLines("keys", kKeys);
  }
  ImGui::End();
}

}  // namespace luxfield::view
