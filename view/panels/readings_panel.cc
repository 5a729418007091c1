#include "luxfield/view/panels/readings_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <string>
#include <string_view>

#include "luxfield/view/picture/profile.h"

namespace luxfield::view {
namespace {

// What a reading says, a quantity on a line.
std::string OnLines(std::string described) {
  constexpr std::string_view kBetween = "  ", kBreak = "\n    ";
  for (std::size_t at = 0; (at = described.find(kBetween, at)) != std::string::npos;
       at += kBreak.size())
    described.replace(at, kBetween.size(), kBreak);
  return described;
}

ImVec2 PlotSize() { return {ImGui::GetContentRegionAvail().x, 4 * ImGui::GetFontSize()}; }

}  // namespace

void ReadingsPanel::Mark(const PictureArea& area) const {
  if (probes_.size() > 1) area.MarkLine(probes_[probes_.size() - 2], probes_.back());
  for (std::size_t i = 0; i < probes_.size(); ++i) area.Mark(probes_[i], static_cast<int>(i) + 1);
}

void ReadingsPanel::Draw(const Document& document, const Look& look) {
  DrawProbes(document);
  if (probes_.size() > 1) DrawProfile(*document.picture());
  DrawHistogram(document, look);
}

void ReadingsPanel::DrawProbes(const Document& document) const {
  if (probes_.empty()) return;
  if (!ImGui::CollapsingHeader("Probes", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const WindowSize whole = document.picture_size();
  for (std::size_t i = 0; i < probes_.size(); ++i)
    if (auto reading = ReadAtPlace(*document.picture(), probes_[i], whole.width, whole.height)) {
      reading->measured_rel_sigma = document.MeasuredRelSigma(*reading);
      ImGui::TextWrapped("%zu: %s", i + 1,
                         OnLines(Describe(*reading, document.picture()->unit)).c_str());
    }
}

void ReadingsPanel::DrawProfile(const render::Frame& frame) {
  if (!ImGui::CollapsingHeader("Profile", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const auto profile = ProfileOf(frame, probes_[probes_.size() - 2], probes_.back());
  if (!frame.irradiance.data.empty()) {
    int shown = along_illuminance_ ? 1 : 0;
    ImGui::RadioButton("reflected##profile", &shown, 0);
    ImGui::SameLine();
    ImGui::RadioButton("arriving##profile", &shown, 1);
    along_illuminance_ = shown == 1;
  }
  std::vector<float> values;
  for (const Reading& reading : profile)
    values.push_back(static_cast<float>(along_illuminance_ ? reading.illuminance.value_or(0)
                                                           : reading.luminance));
  if (values.empty()) return;
  const auto [least, most] = std::ranges::minmax(values);
  ImGui::TextWrapped(
      "%zu to %zu, %.4g to %.4g: %s", probes_.size() - 1, probes_.size(), double{least},
      double{most},
      QuantityOf(along_illuminance_ ? Layer::kIrradiance : Layer::kRadiance, frame.unit).c_str());
  ImGui::PlotLines("##profile", values.data(), static_cast<int>(values.size()), 0, nullptr,
                   std::min(0.0f, least), most > least ? most : FLT_MAX, PlotSize());
  if (ImGui::Button("Copy as a table"))
    ImGui::SetClipboardText(TableOf(profile, frame.unit).c_str());
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("to the clipboard, separated by tabs");
}

void ReadingsPanel::DrawHistogram(const Document& document, const Look& look) {
  if (!ImGui::CollapsingHeader("Histogram")) return;
  const render::Frame& frame = *document.picture();
  if (counted_ != document.picture_number()) {
    counted_ = document.picture_number();
    histogram_ = HistogramOf(frame.radiance);
  }
  const std::string unit = render::RadianceUnitName(frame.unit);
  const ImVec2 at = ImGui::GetCursorScreenPos(), size = PlotSize();
  ImGui::PlotHistogram("##histogram", histogram_.shares.data(),
                       static_cast<int>(histogram_.shares.size()), 0, nullptr, 0, FLT_MAX, size);
  if (!(histogram_.max > 0)) {
    ImGui::TextDisabled("nothing is lit");
    return;
  }
  if (look.tone == Tone::kLinear) {
    const double white =
        std::log(1 / (look.exposure * histogram_.min)) / std::log(histogram_.max / histogram_.min);
    const float x = at.x + size.x * static_cast<float>(white);
    if (white > 0 && white < 1)
      ImGui::GetWindowDrawList()->AddLine(ImVec2(x, at.y), ImVec2(x, at.y + size.y),
                                          IM_COL32(240, 228, 66, 255));
  }
  ImGui::TextWrapped("%.3g to %.3g %s, logarithmic", histogram_.min, histogram_.max, unit.c_str());
  ImGui::TextWrapped("mean %.4g, median %.4g", histogram_.mean, histogram_.median);
  ImGui::TextWrapped("99 %% below %.4g", histogram_.percentile_99);
  if (histogram_.dark > 0)
    ImGui::TextWrapped("%.3g %% of the pixels are dark", 100 * histogram_.dark);
}

}  // namespace luxfield::view
