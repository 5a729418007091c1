#include "luxfield/view/panels/look_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "luxfield/cli/reports/rounded_number.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/view/documents/legend.h"

namespace luxfield::view {
namespace {

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
    Named(Layer::kLightShare, "alpha"),
    Named(Layer::kImageShare, "share of images"),
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

void DrawScale(const render::Frame& frame, render::FalseColourScale scale,
               const LayerSources& sources, bool offers_feedback, Look& look) {
  const Layer before = look.layer;
  Choose("of", kLayers, look.layer, [&](Layer layer) {
    return HasLayer(frame, layer, sources) || (offers_feedback && IsFeedback(layer));
  });
  if (look.layer != before) {
    look.scale.reset();
    return;  // the scale is that of the layer before
  }
  const Layer layer = ShownLayer(frame, look, sources);
  if (layer != look.layer) ImGui::TextDisabled("comes when the picture is at rest; meanwhile:");
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
                   const LayerSources& sources, bool offers_feedback, Look& look) {
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
      ImGui::TextDisabled("white at %s %s", cli::Digits(1 / look.exposure, 4).c_str(),
                          render::RadianceUnitName(frame.unit).c_str());
      break;
    case Tone::kFalseColour:
      DrawScale(frame, scale, sources, offers_feedback, look);
  }
}

}  // namespace luxfield::view
