#include "luxfield/view/panels/histogram_plot.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/view/documents/legend.h"

namespace luxfield::view {
namespace {

constexpr float kHeight = 5;  // in heights of a letter
constexpr ImU32 kWhite = IM_COL32(255, 255, 255, 255);

void DrawBars(const Histogram& histogram, ImVec2 at, ImVec2 size) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, ImVec2(at.x + size.x, at.y + size.y),
                      ImGui::GetColorU32(ImGuiCol_FrameBg));
  const float most = std::ranges::max(histogram.shares);
  const float bar = size.x / static_cast<float>(histogram.shares.size());
  for (std::size_t i = 0; i < histogram.shares.size(); ++i) {
    const float left = at.x + bar * static_cast<float>(i);
    const float height = size.y * histogram.shares[i] / most;
    if (height > 0)
      list->AddRectFilled(ImVec2(left, at.y + size.y - height), ImVec2(left + bar, at.y + size.y),
                          ImGui::GetColorU32(ImGuiCol_PlotHistogram));
  }
}

// What the bar under the pointer stands for.
void DrawBarsTip(const Histogram& histogram, const std::string& unit, float x) {
  const auto bins = static_cast<double>(histogram.shares.size());
  const auto bin = static_cast<std::size_t>(std::clamp(double{x} * bins, 0.0, bins - 1));
  const auto edge = [&](double i) {
    return cli::Digits(histogram.min * std::pow(histogram.max / histogram.min, i / bins), 3);
  };
  const auto left = static_cast<double>(bin);
  ImGui::SetTooltip("%s to %s %s: %s %% of the pixels", edge(left).c_str(), edge(left + 1).c_str(),
                    unit.c_str(), cli::Digits(100 * double{histogram.shares[bin]}, 3).c_str());
}

}  // namespace

void DrawHistogramPlot(const Histogram& histogram, const std::string& unit,
                       const std::optional<double>& white) {
  const ImVec2 at = ImGui::GetCursorScreenPos(),
               size(ImGui::GetContentRegionAvail().x, kHeight * ImGui::GetFontSize());
  DrawBars(histogram, at, size);
  const render::FalseColourScale scale{histogram.min, histogram.max};
  if (white) {
    const double position = PositionOn(scale, Layer::kRadiance, *white).value_or(-1);
    const float x = at.x + size.x * static_cast<float>(position);
    if (position >= 0 && position <= 1)
      ImGui::GetWindowDrawList()->AddLine(ImVec2(x, at.y), ImVec2(x, at.y + size.y), kWhite);
  }
  const float ticks = DrawTicks(scale, Layer::kRadiance, ImVec2(at.x, at.y + size.y), size.x);
  ImGui::InvisibleButton("##histogram", size);
  if (ImGui::IsItemHovered())
    DrawBarsTip(histogram, unit, (ImGui::GetIO().MousePos.x - at.x) / size.x);
  ImGui::Dummy(ImVec2(size.x, ticks));
}

}  // namespace luxfield::view
