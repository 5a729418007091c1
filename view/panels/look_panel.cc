#include "luxfield/view/panels/look_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "luxfield/core/colour.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::view {
namespace {

constexpr int kSteps = 64;  // of the legend's bar

// Exposures and k are doublings, so that steps look equal.
bool SliderOfStops(const char* name, double& value) {
  float stops = static_cast<float>(std::log2(value));
  if (!ImGui::SliderFloat(name, &stops, -24, 24, "%+.2f stops")) return false;
  value = std::exp2(std::clamp(stops, -40.0f, 40.0f));
  return true;
}

std::string QuantityOf(const render::Frame& frame, const Look& look) {
  const bool lumen = frame.unit == lightfield::FluxUnit::kLumen;
  if (&Shown(frame, look) == &frame.irradiance)
    return std::string(lumen ? "illuminance" : "irradiance") + " in " +
           render::IrradianceUnitName(frame.unit) + ", direct light only";
  return std::string(lumen ? "luminance" : "radiance") + " in " +
         render::RadianceUnitName(frame.unit);
}

ImU32 ColourAt(double position) {
  const core::Rgb colour = core::FalseColour(position);
  return ImGui::ColorConvertFloat4ToU32(ImVec4(static_cast<float>(colour[0]),
                                               static_cast<float>(colour[1]),
                                               static_cast<float>(colour[2]), 1));
}

// A bar from the lowest value on the left to the highest, with ticks at 1 of every decade and at 2
// and 5 where these have room.
void DrawLegend(const render::FalseColourScale& scale) {
  const float line = ImGui::GetTextLineHeight(), width = ImGui::GetContentRegionAvail().x;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (int i = 0; i < kSteps; ++i)
    list->AddRectFilled(ImVec2(at.x + width * static_cast<float>(i) / kSteps, at.y),
                        ImVec2(at.x + width * static_cast<float>(i + 1) / kSteps, at.y + line),
                        ColourAt((i + 0.5) / kSteps));
  const ImU32 ink = ImGui::GetColorU32(ImGuiCol_Text);
  const double decades = std::log10(scale.max / scale.min);
  float free_from = at.x;  // where no label stands yet
  for (int decade = static_cast<int>(std::floor(std::log10(scale.min)));
       decade <= std::ceil(std::log10(scale.max)); ++decade)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, decade);
      if (value < scale.min * 0.999 || value > scale.max * 1.001) continue;
      const float x = at.x + width * static_cast<float>(std::log10(value / scale.min) / decades);
      list->AddLine(ImVec2(x, at.y + line), ImVec2(x, at.y + 1.3f * line), ink);
      const std::string label = render::TickLabel(value);
      const float size = ImGui::CalcTextSize(label.c_str()).x;
      const float left = std::clamp(x - 0.5f * size, at.x, at.x + width - size);
      if (left < free_from) continue;
      list->AddText(ImVec2(left, at.y + 1.3f * line), ink, label.c_str());
      free_from = left + size + 0.5f * line;
    }
  ImGui::Dummy(ImVec2(width, 2.6f * line));
}

void DrawScale(const render::Frame& frame, render::FalseColourScale scale, Look& look) {
  if (!frame.irradiance.data.empty()) {
    int shown = look.irradiance ? 1 : 0;
    ImGui::RadioButton("reflected", &shown, 0);
    ImGui::SameLine();
    ImGui::RadioButton("arriving", &shown, 1);
    look.irradiance = shown == 1;
  }
  ImGui::TextUnformatted(QuantityOf(frame, look).c_str());
  DrawLegend(scale);
  bool automatic = !look.scale;
  if (ImGui::Checkbox("range from the picture", &automatic)) {
    if (automatic)
      look.scale.reset();
    else
      look.scale = scale;
  }
  if (automatic) return;
  ImGui::InputDouble("lowest", &scale.min, 0, 0, "%.4g");
  ImGui::InputDouble("highest", &scale.max, 0, 0, "%.4g");
  if (scale.min > 0 && scale.max > scale.min) look.scale = scale;
}

}  // namespace

void DrawLookPanel(const render::Frame& frame, const render::FalseColourScale& scale, Look& look) {
  if (!ImGui::CollapsingHeader("Tone", ImGuiTreeNodeFlags_DefaultOpen)) return;
  int tone = static_cast<int>(look.tone);
  ImGui::RadioButton("exponential", &tone, static_cast<int>(Tone::kExponential));
  ImGui::SameLine();
  ImGui::RadioButton("linear", &tone, static_cast<int>(Tone::kLinear));
  ImGui::SameLine();
  ImGui::RadioButton("false colour", &tone, static_cast<int>(Tone::kFalseColour));
  look.tone = static_cast<Tone>(tone);
  if (look.tone == Tone::kExponential) {
    SliderOfStops("exposure", look.k);
    ImGui::TextDisabled("1 - exp(-k L / mean L), k = %.3g", look.k);
  } else if (look.tone == Tone::kLinear) {
    SliderOfStops("exposure", look.exposure);
    ImGui::TextDisabled("white at %.4g %s", 1 / look.exposure,
                        render::RadianceUnitName(frame.unit).c_str());
  } else {
    DrawScale(frame, scale, look);
  }
}

}  // namespace luxfield::view
