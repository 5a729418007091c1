#include "luxfield/view/panels/look_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

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

struct Choice {
  int value;
  const char* name;
};

template <typename Enum>
constexpr Choice Named(Enum value, const char* name) {
  return {static_cast<int>(value), name};
}

constexpr Choice kTones[] = {
    Named(Tone::kExponential, "exponential"), Named(Tone::kExponentialHue, "exponential, hue kept"),
    Named(Tone::kFilmic, "filmic, hue kept"), Named(Tone::kLinear, "linear"),
    Named(Tone::kFalseColour, "false colour")};
constexpr Choice kLayers[] = {
    Named(Layer::kRadiance, "reflected light"),
    Named(Layer::kIrradiance, "arriving light"),
    Named(Layer::kCoverage, "coverage"),
    Named(Layer::kSamples, "samples a pixel"),
    Named(Layer::kNoise, "noise"),
    Named(Layer::kLab, "Lab difference"),
};

// A list of which one is chosen, those alone that `has` takes.
template <typename Enum, std::size_t N, typename Has>
void Choose(const char* label, const Choice (&choices)[N], Enum& chosen, const Has& has) {
  const auto of = [](const Choice& choice) { return static_cast<Enum>(choice.value); };
  const auto now = std::ranges::find(choices, static_cast<int>(chosen), &Choice::value);
  if (!ImGui::BeginCombo(label, now->name)) return;
  for (const Choice& choice : choices)
    if (has(of(choice)) && ImGui::Selectable(choice.name, of(choice) == chosen))
      chosen = of(choice);
  ImGui::EndCombo();
}

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

// A bar from the lowest value on the left to the highest, with ticks, and labels where these have
// room.
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
    const std::string label = render::TickLabel(tick.value);
    const float size = ImGui::CalcTextSize(label.c_str()).x;
    const float left = std::clamp(x - 0.5f * size, at.x, at.x + width - size);
    if (left < free_from) continue;
    list->AddText(ImVec2(left, at.y + 1.3f * line), ink, label.c_str());
    free_from = left + size + 0.5f * line;
  }
  ImGui::Dummy(ImVec2(width, 2.6f * line));
}

void DrawScale(const render::Frame& frame, render::FalseColourScale scale,
               const core::Image* reference, Look& look) {
  const Layer before = look.layer;
  Choose("of", kLayers, look.layer, [&](Layer layer) { return HasLayer(frame, layer, reference); });
  if (look.layer != before) {
    look.scale.reset();
    return;  // the scale is that of the layer before
  }
  const Layer layer = ShownLayer(frame, look, reference);
  ImGui::TextWrapped("%s", QuantityOf(layer, frame.unit).c_str());
  DrawLegend(scale, layer);
  ImGui::Checkbox(layer == Layer::kIrradiance ? "isolux lines" : "lines of equal value",
                  &look.contours);
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(IsLinear(layer) ? "at every tenth of the scale"
                                      : "at 1, 2 and 5 of every decade");
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
  const bool possible = IsLinear(layer) ? scale.min >= 0 : scale.min > 0;
  if (possible && scale.max > scale.min) look.scale = scale;
}

}  // namespace

void DrawLookPanel(const render::Frame& frame, const render::FalseColourScale& scale,
                   const core::Image* reference, Look& look) {
  if (!ImGui::CollapsingHeader("Tone", ImGuiTreeNodeFlags_DefaultOpen)) return;
  Choose("operator", kTones, look.tone, [](Tone) { return true; });
  switch (look.tone) {
    case Tone::kExponential:
    case Tone::kExponentialHue:
      SliderOfStops("exposure", look.k);
      ImGui::TextDisabled("1 - exp(-k L / mean L), k = %.3g", look.k);
      break;
    case Tone::kFilmic:
      SliderOfStops("exposure", look.k);
      ImGui::TextDisabled("the mean times %.3g is a middle grey", 1 / look.k);
      break;
    case Tone::kLinear:
      SliderOfStops("exposure", look.exposure);
      ImGui::TextDisabled("white at %.4g %s", 1 / look.exposure,
                          render::RadianceUnitName(frame.unit).c_str());
      break;
    case Tone::kFalseColour:
      DrawScale(frame, scale, reference, look);
  }
}

}  // namespace luxfield::view
