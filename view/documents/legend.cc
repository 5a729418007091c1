#include "luxfield/view/documents/legend.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "luxfield/core/colour.h"

namespace luxfield::view {
namespace {

constexpr int kSteps = 64;  // of the bar

ImU32 ColourAt(double position) {
  const core::Rgb colour = core::FalseColour(position);
  return ImGui::ColorConvertFloat4ToU32(ImVec4(static_cast<float>(colour[0]),
                                               static_cast<float>(colour[1]),
                                               static_cast<float>(colour[2]), 1));
}

struct Tick {
  double position, value;
};

// 1, 2 and 5 of every decade; of linear scales every tenth.
std::vector<Tick> TicksOf(const render::FalseColourScale& scale, Layer layer) {
  constexpr int kTenths = 10;
  std::vector<Tick> ticks;
  if (IsLinear(layer)) {
    for (int i = 0; i <= kTenths; ++i) {
      const double position = static_cast<double>(i) / kTenths;
      ticks.push_back({position, std::lerp(scale.min, scale.max, position)});
    }
    return ticks;
  }
  for (int decade = static_cast<int>(std::floor(std::log10(scale.min)));
       decade <= std::ceil(std::log10(scale.max)); ++decade)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, decade);
      if (value < scale.min * 0.999 || value > scale.max * 1.001) continue;
      ticks.push_back({*PositionOn(scale, layer, value), value});
    }
  return ticks;
}

}  // namespace

void DrawLegend(const render::FalseColourScale& scale, Layer layer) {
  const float line = ImGui::GetTextLineHeight(), width = ImGui::GetContentRegionAvail().x;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (int i = 0; i < kSteps; ++i)
    list->AddRectFilled(ImVec2(at.x + width * static_cast<float>(i) / kSteps, at.y),
                        ImVec2(at.x + width * static_cast<float>(i + 1) / kSteps, at.y + line),
                        ColourAt((i + 0.5) / kSteps));
  const ImU32 ink = ImGui::GetColorU32(ImGuiCol_Text);
  float free_from = at.x;  // where no label stands yet
  for (const Tick& tick : TicksOf(scale, layer)) {
    const float x = at.x + width * static_cast<float>(tick.position);
    list->AddLine(ImVec2(x, at.y + line), ImVec2(x, at.y + 1.3f * line), ink);
    const std::string label = tick.value == 0 ? "0" : render::TickLabel(tick.value);
    const float size = ImGui::CalcTextSize(label.c_str()).x;
    const float left = std::clamp(x - 0.5f * size, at.x, at.x + width - size);
    if (left < free_from) continue;
    list->AddText(ImVec2(left, at.y + 1.3f * line), ink, label.c_str());
    free_from = left + size + 0.5f * line;
  }
  ImGui::Dummy(ImVec2(width, 2.6f * line));
}

}  // namespace luxfield::view
