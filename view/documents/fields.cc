#include "luxfield/view/documents/fields.h"

#include <imgui.h>

namespace luxfield::view {

void Fields::See(bool changed, const char* tip) {
  if (ImGui::IsItemActivated()) editor_.Begin();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", tip);
  changed_ |= changed;
  ended_ |= ImGui::IsItemDeactivatedAfterEdit();
}

void Fields::Drag(const char* name, double& value, float step, double low, double high,
                  const char* format, const char* tip) {
  See(ImGui::DragScalar(name, ImGuiDataType_Double, &value, step, &low, &high, format,
                        ImGuiSliderFlags_AlwaysClamp),
      tip);
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

}  // namespace luxfield::view
