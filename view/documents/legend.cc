#include "luxfield/view/documents/legend.h"

#include <string>

#include "luxfield/core/colour.h"
#include "luxfield/view/picture/ticks.h"

namespace luxfield::view {
namespace {

constexpr int kSteps = 64;           // of the bar
constexpr float kTickHeight = 0.3f;  // in heights of a line

ImU32 ColourAt(double position) {
  const core::Rgb colour = core::FalseColour(position);
  return ImGui::ColorConvertFloat4ToU32(ImVec4(static_cast<float>(colour[0]),
                                               static_cast<float>(colour[1]),
                                               static_cast<float>(colour[2]), 1));
}

}  // namespace

float DrawTicks(const render::FalseColourScale& scale, Layer layer, ImVec2 at, float width) {
  const float line = ImGui::GetTextLineHeight();
  ImDrawList* list = ImGui::GetWindowDrawList();
  const ImU32 ink = ImGui::GetColorU32(ImGuiCol_Text);
  const std::vector<Tick> ticks = TicksOf(scale, layer);
  for (const Tick& tick : ticks) {
    const float x = at.x + width * static_cast<float>(tick.position);
    list->AddLine(ImVec2(x, at.y), ImVec2(x, at.y + kTickHeight * line), ink);
  }
  const auto width_of = [](const std::string& text) {
    return double{ImGui::CalcTextSize(text.c_str()).x};
  };
  for (const TickText& label : TextsOf(ticks, double{width}, 0.5 * line, width_of))
    list->AddText(ImVec2(at.x + static_cast<float>(label.left), at.y + kTickHeight * line), ink,
                  label.text.c_str());
  return (1 + kTickHeight) * line;
}

void DrawLegend(const render::FalseColourScale& scale, Layer layer) {
  const float line = ImGui::GetTextLineHeight(), width = ImGui::GetContentRegionAvail().x;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (int i = 0; i < kSteps; ++i)
    list->AddRectFilled(ImVec2(at.x + width * static_cast<float>(i) / kSteps, at.y),
                        ImVec2(at.x + width * static_cast<float>(i + 1) / kSteps, at.y + line),
                        ColourAt((i + 0.5) / kSteps));
  const float ticks = DrawTicks(scale, layer, ImVec2(at.x, at.y + line), width);
  ImGui::Dummy(ImVec2(width, line + ticks + 0.3f * line));
}

}  // namespace luxfield::view
