#include "luxfield/view/documents/images_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "luxfield/core/error.h"
#include "luxfield/core/printable.h"
#include "luxfield/view/documents/legend.h"
#include "luxfield/view/lighting/failure.h"
#include "luxfield/view/lighting/measured_lamps.h"
#include "luxfield/view/picture/look.h"
#include "luxfield/view/picture/reading.h"
#include "luxfield/view/window/window.h"

namespace luxfield::view {
namespace {

// Of C: the unit of flux over sr m^4 (lightfield/light_field.h).
std::string UnitOf(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "lm/(sr m4)";
    case lightfield::FluxUnit::kWatt:
      return "W/(sr m4)";
    case lightfield::FluxUnit::kRelative:
      break;
  }
  return "rel.";
}

}  // namespace

void ImagesPanel::Read(const std::filesystem::path& light_field) {
  fields_.reset();
  texture_.reset();
  refusal_.clear();
  field_ = 0;
  shows_sigma_ = false;
  reading_ = std::async(std::launch::async, [light_field] {
    Fields fields;
    fields.c = lightfield::ReadLightFields(light_field);
    if (const auto sigma = SigmaBeside(light_field); std::filesystem::exists(sigma)) {
      fields.sigma = lightfield::ReadLightFields(sigma);
      const auto same = [](const auto& a, const auto& b) {
        return a.field.geometry.grid.count() == b.field.geometry.grid.count() &&
               a.field.geometry.lattice == b.field.geometry.lattice;
      };
      if (!std::ranges::equal(fields.c, fields.sigma, same))
        throw InputError(sigma.string(), "has other images than " + light_field.string(),
                         "take the files of one reconstruction");
    }
    Window::Wake();
    return fields;
  });
}

bool ImagesPanel::ready() const { return !reading_.valid() || texture_ || !refusal_.empty(); }

const lightfield::LightField& ImagesPanel::Shown() const {
  return (shows_sigma_ ? fields_->sigma : fields_->c)[field_].field;
}

void ImagesPanel::Update() {
  if (fields_ || !refusal_.empty() || !reading_.valid() ||
      reading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return;
  try {
    fields_ = reading_.get();
    MakeSheet();
  } catch (const std::exception&) {
    refusal_ = CurrentFailure().sentence;
  }
}

void ImagesPanel::MakeSheet() {
  sheet_ = ContactSheetOf(Shown());
  render::Frame frame;
  frame.width = sheet_.values.width;
  frame.height = sheet_.values.height;
  frame.radiance = core::Image(frame.width, frame.height, 3);
  for (int c = 0; c < 3; ++c)
    std::ranges::copy(sheet_.values.data, frame.radiance.plane(c).begin());
  Look look;
  look.tone = Tone::kFalseColour;
  look.scale = scale_ = render::AutomaticScale(sheet_.values);
  if (!texture_) texture_ = std::make_unique<ScreenTexture>();
  texture_->Show(ColoursOf(frame, look), frame.width, frame.height);
}

void ImagesPanel::DrawTip(int column, int row) const {
  const auto& c = fields_->c[field_].field;
  const SheetPlace place = PlaceOn(sheet_, c, column, row);
  std::optional<double> sigma;
  if (!fields_->sigma.empty()) sigma = LuminanceOf(fields_->sigma[field_].field, place);
  const std::string text = fmt::format(
      "image i {}, j {}; texel column {}, row {}\nC {} {}", place.i, place.j, place.column,
      place.row, WithSigma(LuminanceOf(c, place), sigma), UnitOf(c.geometry.unit));
  ImGui::SetTooltip("%s", text.c_str());
}

void ImagesPanel::DrawSheet(float width) {
  const float height =
      width * static_cast<float>(sheet_.values.height) / static_cast<float>(sheet_.values.width);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Image(texture_->id(), ImVec2(width, height));
  const auto& grid = Shown().geometry.grid;
  ImDrawList* list = ImGui::GetWindowDrawList();
  constexpr ImU32 kLine = IM_COL32(120, 120, 124, 255);
  for (int i = 0; i <= grid.width; ++i) {
    const float x = at.x + width * static_cast<float>(i) / static_cast<float>(grid.width);
    list->AddLine(ImVec2(x, at.y), ImVec2(x, at.y + height), kLine);
  }
  for (int j = 0; j <= grid.height; ++j) {
    const float y = at.y + height * static_cast<float>(j) / static_cast<float>(grid.height);
    list->AddLine(ImVec2(at.x, y), ImVec2(at.x + width, y), kLine);
  }
  if (!ImGui::IsItemHovered()) return;
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const auto on = [](float part, int count) {
    return std::clamp(static_cast<int>(part * static_cast<float>(count)), 0, count - 1);
  };
  DrawTip(on((mouse.x - at.x) / width, sheet_.values.width),
          on((mouse.y - at.y) / height, sheet_.values.height));
}

void ImagesPanel::Draw() {
  if (!ImGui::CollapsingHeader("Images", ImGuiTreeNodeFlags_DefaultOpen)) return;
  if (!refusal_.empty()) return ImGui::TextWrapped("%s", core::OnOneLine(refusal_).c_str());
  if (!fields_) return ImGui::TextDisabled("reading ...");
  bool anew = false;
  if (fields_->c.size() > 1 &&
      ImGui::BeginCombo("of", core::OnOneLine(fields_->c[field_].name).c_str())) {
    for (std::size_t k = 0; k < fields_->c.size(); ++k)
      if (ImGui::Selectable(core::OnOneLine(fields_->c[k].name).c_str(), k == field_)) {
        field_ = k;
        anew = true;
      }
    ImGui::EndCombo();
  }
  if (fields_->sigma.empty()) {
    ImGui::TextDisabled("sigma(C) is not known: no .sigma.lf.exr beside it");
  } else {
    int which = shows_sigma_ ? 1 : 0;
    anew |= ImGui::RadioButton("C", &which, 0);
    ImGui::SameLine();
    anew |= ImGui::RadioButton("sigma(C)", &which, 1);
    ImGui::SameLine();
    shows_sigma_ = which == 1;
  }
  ImGui::Checkbox("large", &large_);
  if (anew) MakeSheet();
  const auto& geometry = Shown().geometry;
  ImGui::TextWrapped("%s of %d x %d images of %d x %d texels, %s", shows_sigma_ ? "sigma(C)" : "C",
                     geometry.grid.width, geometry.grid.height, geometry.lattice.width,
                     geometry.lattice.height, UnitOf(geometry.unit).c_str());
  DrawLegend(scale_, Layer::kRadiance);
  const float width = ImGui::GetContentRegionAvail().x;
  DrawSheet(width);
  if (!large_) return;
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(ImGui::GetFontSize(), ImGui::GetFontSize()), ImGuiCond_Appearing);
  ImGui::SetNextWindowSize(ImVec2(0.6f * window.x, 0.85f * window.y), ImGuiCond_Appearing);
  if (ImGui::Begin("Images of the light field", &large_,
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_HorizontalScrollbar)) {
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const float aspect =
        static_cast<float>(sheet_.values.width) / static_cast<float>(sheet_.values.height);
    DrawSheet(std::min(room.x, room.y * aspect));
  }
  ImGui::End();
}

}  // namespace luxfield::view
