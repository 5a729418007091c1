#include "luxfield/view/documents/fields.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/colour.h"
#include "luxfield/view/picture/look.h"

namespace luxfield::view {
namespace {

constexpr double kDigit = 1e4;  // of factors that are chosen by eye
constexpr double kFactorStep = 0.005;

// The colour that is encoded like that, which is not black, so bright that its largest channel is
// `largest`.
std::array<double, 3> Brightened(const float (&encoded)[3], double largest) {
  const double most = SrgbDecode(std::ranges::max(encoded));
  std::array<double, 3> factors{};
  for (std::size_t c = 0; c < 3; ++c)
    factors[c] = std::round(SrgbDecode(encoded[c]) / most * largest * kDigit) / kDigit;
  return factors;
}

}  // namespace

void Fields::See(bool changed, const char* tip) {
  if (ImGui::IsItemActivated()) editor_.Begin();
  if (tip && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tip);
  changed_ |= changed;
  ended_ |= ImGui::IsItemDeactivatedAfterEdit();
}

void Fields::Drag(const char* name, double& value, float step, double low, double high,
                  const char* format, const char* tip) {
  See(ImGui::DragScalar(name, ImGuiDataType_Double, &value, step, &low, &high, format,
                        ImGuiSliderFlags_AlwaysClamp),
      tip);
}

void Fields::Factor(const char* name, double& value, double high, const char* tip) {
  const double size = value > 0 ? value : 1;
  Drag(name, value, static_cast<float>(kFactorStep * size), 0, high, "%.4g", tip);
}

void Fields::Drag(const char* name, lightfield::Vec3& v, float step, double limit,
                  const char* format, const char* tip) {
  const double low = -limit;
  double values[3] = {v.x, v.y, v.z};
  const bool changed = ImGui::DragScalarN(name, ImGuiDataType_Double, values, 3, step, &low, &limit,
                                          format, ImGuiSliderFlags_AlwaysClamp);
  if (changed) v = {values[0], values[1], values[2]};
  See(changed, tip);
}

void Fields::Colour(const char* name, std::array<double, 3>& linear, const char* tip) {
  constexpr double kLow = 0, kHigh = 1;
  See(ImGui::DragScalarN(name, ImGuiDataType_Double, linear.data(), 3, 0.003f, &kLow, &kHigh,
                         "%.3f", ImGuiSliderFlags_AlwaysClamp),
      tip);
}

void Fields::Tint(const char* name, std::array<double, 3>& factors, double high, const char* tip) {
  constexpr double kLow = 0;
  constexpr const char* kPicker = "picker";
  const double largest = std::ranges::max(factors), whole = largest > 0 ? largest : 1;
  float shown[3];
  for (std::size_t c = 0; c < 3; ++c)
    shown[c] = static_cast<float>(core::SrgbEncode(factors[c] / whole));
  ImGui::PushID(name);
  if (ImGui::ColorButton("swatch", {shown[0], shown[1], shown[2], 1},
                         ImGuiColorEditFlags_NoTooltip))
    ImGui::OpenPopup(kPicker);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("chooses the colour");
  if (ImGui::BeginPopup(kPicker)) {
    const bool picked =
        ImGui::ColorPicker3("##colour", shown,
                            ImGuiColorEditFlags_NoSidePreview | ImGuiColorEditFlags_NoSmallPreview |
                                ImGuiColorEditFlags_NoInputs);
    const bool changes = picked && std::ranges::max(shown) > 0;
    if (changes) factors = Brightened(shown, whole);
    See(changes);
    ImGui::EndPopup();
  }
  ImGui::SameLine(0, ImGui::GetStyle().ItemInnerSpacing.x);
  ImGui::SetNextItemWidth(ImGui::CalcItemWidth() - ImGui::GetFrameHeight() -
                          ImGui::GetStyle().ItemInnerSpacing.x);
  See(ImGui::DragScalarN(name, ImGuiDataType_Double, factors.data(), 3, 0.003f, &kLow, &high,
                         "%.3f", ImGuiSliderFlags_AlwaysClamp),
      tip);
  ImGui::PopID();
}

}  // namespace luxfield::view
