#include "luxfield/view/panels/readings_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/view/panels/histogram_plot.h"
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

// Whether light that arrives is chosen, which a picture may hold, and not the light that is reflected.
bool DrawChoice(const char* of, const render::Frame& frame, bool& arriving) {
  if (frame.irradiance.data.empty()) return false;
  ImGui::PushID(of);
  if (ImGui::RadioButton("reflected", !arriving)) arriving = false;
  ImGui::SameLine();
  if (ImGui::RadioButton("arriving", arriving)) arriving = true;
  ImGui::PopID();
  return arriving;
}

ImVec2 PlotSize() { return {ImGui::GetContentRegionAvail().x, 4 * ImGui::GetFontSize()}; }

}  // namespace

void ReadingsPanel::Mark(const PictureArea& area) const {
  if (probes_.size() > 1) area.MarkLine(probes_[probes_.size() - 2], probes_.back());
  for (std::size_t i = 0; i < probes_.size(); ++i) area.Mark(probes_[i], static_cast<int>(i) + 1);
}

void ReadingsPanel::Draw(const Document& document, const Look& look,
                         const std::optional<double>& saturated) {
  DrawProbes(document);
  if (probes_.size() > 1) DrawProfile(*document.picture());
  DrawHistogram(document, look, saturated);
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
  const bool arriving = DrawChoice("profile", frame, along_illuminance_);
  std::vector<float> values;
  values.reserve(profile.size());
  for (const Reading& reading : profile)
    values.push_back(
        static_cast<float>(arriving ? reading.illuminance.value_or(0) : reading.luminance));
  if (values.empty()) return;
  const auto [least, most] = std::ranges::minmax(values);
  ImGui::TextWrapped(
      "%zu to %zu, %s to %s: %s", probes_.size() - 1, probes_.size(),
      cli::Digits(double{least}, 4).c_str(), cli::Digits(double{most}, 4).c_str(),
      QuantityOf(arriving ? Layer::kIrradiance : Layer::kRadiance, frame.unit).c_str());
  ImGui::PlotLines("##profile", values.data(), static_cast<int>(values.size()), 0, nullptr,
                   std::min(0.0f, least), most > least ? most : FLT_MAX, PlotSize());
  if (ImGui::Button("Copy as a table"))
    ImGui::SetClipboardText(TableOf(profile, frame.unit).c_str());
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("to the clipboard, separated by tabs");
}

// "mean 12.3, median 4.56", with the share of pixels that have none and of those beyond white.
void ReadingsPanel::DrawNumbers(const std::optional<double>& saturated) const {
  const auto number = [](double value) { return cli::Digits(value, 4); };
  ImGui::TextWrapped("mean %s, median %s", number(histogram_.mean).c_str(),
                     number(histogram_.median).c_str());
  ImGui::TextWrapped("99 %% below %s, largest %s", number(histogram_.percentile_99).c_str(),
                     number(histogram_.max).c_str());
  if (histogram_.dark > 0)
    ImGui::TextWrapped("%.3g %% of the pixels are dark", 100 * histogram_.dark);
  if (histogram_.below > 0)
    ImGui::TextWrapped("%.3g %% lie below %s", 100 * histogram_.below,
                       number(histogram_.min).c_str());
  if (!saturated) return;
  ImGui::TextWrapped("%.3g %% of the pixels are saturated on the screen", 100 * *saturated);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("red, green or blue is at its largest there (255)");
}

void ReadingsPanel::DrawHistogram(const Document& document, const Look& look,
                                  const std::optional<double>& saturated) {
  if (!ImGui::CollapsingHeader("Histogram")) return;
  const render::Frame& frame = *document.picture();
  const bool arriving = DrawChoice("histogram", frame, of_illuminance_);
  const Counted now{document.picture_number(), arriving};
  if (std::exchange(counted_, now) != now)
    histogram_ = HistogramOf(arriving ? frame.irradiance : frame.radiance);
  if (!(histogram_.max > 0)) {
    ImGui::TextDisabled("nothing is lit");
    return;
  }
  const bool has_white = look.tone == Tone::kLinear && !arriving;
  ImGui::TextWrapped(
      "%s", QuantityOf(arriving ? Layer::kIrradiance : Layer::kRadiance, frame.unit).c_str());
  DrawHistogramPlot(
      histogram_,
      arriving ? render::IrradianceUnitName(frame.unit) : render::RadianceUnitName(frame.unit),
      has_white ? std::optional(1 / look.exposure) : std::nullopt);
  if (has_white)
    ImGui::TextWrapped("white, the line, at %s", cli::Digits(1 / look.exposure, 4).c_str());
  DrawNumbers(saturated);
}

}  // namespace luxfield::view
