#include "luxfield/view/documents/lamp_gizmo.h"

#include <fmt/format.h>
#include <imgui.h>

#include <cmath>
#include <string>
#include <utility>

namespace luxfield::view {
namespace {

using lightfield::Vec3;

constexpr double kArrow = 0.12;      // of the picture's height
constexpr double kReach_px = 9;      // of the pointer around a handle, at the font's usual size
constexpr float kUsualFont_px = 15;  // that sizes of handles are given for
constexpr double kAimFar_m = 1;      // where the ring of a lamp stands that is placed by angles

struct Arrow {
  Vec3 direction;
  ImU32 colour;  // of Okabe and Ito (2008), which eyes of every kind tell apart
  const char* name;
};
const Arrow kAxes[] = {{{1, 0, 0}, IM_COL32(213, 94, 0, 255), "x"},
                       {{0, 1, 0}, IM_COL32(0, 158, 115, 255), "y"},
                       {{0, 0, 1}, IM_COL32(86, 180, 233, 255), "z"}};
constexpr ImU32 kAimColour = IM_COL32(240, 228, 66, 255), kInk = IM_COL32(0, 0, 0, 200);

float Size() { return ImGui::GetFontSize() / kUsualFont_px; }

ImVec2 OnScreen(const PictureRect& area, const scene::Camera& camera, PicturePoint at) {
  return {static_cast<float>(area.left + at.column / camera.width * area.width),
          static_cast<float>(area.top + at.row / camera.height * area.height)};
}

std::optional<ImVec2> OnScreen(const PictureRect& area, const scene::Camera& camera, Vec3 point) {
  const auto seen = SeenAt(camera, point);
  if (!seen) return {};
  return OnScreen(area, camera, *seen);
}

double Apart(ImVec2 a, ImVec2 b) { return std::hypot(a.x - b.x, a.y - b.y); }

Vec3 AimOf(const LampPlacement& lamp) {
  if (lamp.look_at) return *lamp.look_at;
  return lamp.position + kAimFar_m * scene::RotationXyz(lamp.rotate_deg).Vector({0, 0, 1});
}

Vec3 ArrowTip(const scene::Camera& camera, const LampPlacement& lamp, const Arrow& axis) {
  return lamp.position + kArrow * HeightAt(camera, lamp.position) * axis.direction;
}

void OutlinedLine(ImVec2 from, ImVec2 to, ImU32 colour, float width) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddLine(from, to, kInk, width + 2 * Size());
  list->AddLine(from, to, colour, width);
}

void OutlinedText(ImVec2 at, const std::string& text) {
  ImDrawList* list = ImGui::GetWindowDrawList();
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const float margin = 3 * Size();
  list->AddRectFilled(ImVec2(at.x - margin, at.y - margin),
                      ImVec2(at.x + size.x + margin, at.y + size.y + margin), kInk, margin);
  list->AddText(at, IM_COL32(255, 255, 255, 255), text.c_str());
}

std::string NumbersOf(const LampPlacement& lamp) {
  const Vec3 &p = lamp.position, &a = lamp.look_at ? *lamp.look_at : lamp.rotate_deg;
  return fmt::format("{}\nat {:.3f} {:.3f} {:.3f} m\n{} {:.3f} {:.3f} {:.3f} {}", lamp.name, p.x,
                     p.y, p.z, lamp.look_at ? "looks at" : "turned by", a.x, a.y, a.z,
                     lamp.look_at ? "m" : "deg");
}

}  // namespace

bool LampGizmo::Draw(const PictureRect& area, bool hovered, const scene::Camera& camera,
                     SceneEditor& editor, std::size_t& chosen) {
  has_mouse_ = grip_.has_value();
  if (editor.lamps().empty()) return false;
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const PicturePoint pointer{(mouse.x - area.left) / area.width * camera.width,
                             (mouse.y - area.top) / area.height * camera.height};
  std::optional<Handle> at;
  if (grip_)
    at = grip_->handle;
  else if (hovered)
    at = HandleAt(area, camera, editor.lamps()[chosen], pointer);
  has_mouse_ = at.has_value();
  if (hovered && !grip_ && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    if (at) {
      const LampPlacement& lamp = editor.lamps()[chosen];
      editor.Begin();
      grip_ = Grip{*at, lamp};
      if (*at != Handle::kAim)
        grip_->along_m =
            AlongAxis(camera, pointer, lamp.position, kAxes[static_cast<int>(*at)].direction)
                .value_or(0);
    } else {
      Choose(area, camera, editor, pointer, chosen);
    }
  }
  bool changed = false;
  if (grip_ && ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
    const ImVec2 moved = ImGui::GetIO().MouseDelta;
    if (moved.x != 0 || moved.y != 0) changed = Pull(camera, pointer, editor, chosen);
  } else if (grip_) {
    editor.End();
    grip_.reset();
  }
  for (std::size_t i = 0; i < editor.lamps().size(); ++i)
    if (const auto dot = OnScreen(area, camera, editor.lamps()[i].position)) {
      ImGui::GetWindowDrawList()->AddCircleFilled(*dot, 5 * Size(), kInk);
      ImGui::GetWindowDrawList()->AddCircleFilled(*dot, 3.5f * Size(), kAimColour);
    }
  DrawLamp(area, camera, editor.lamps()[chosen], at);
  return changed;
}

std::optional<LampGizmo::Handle> LampGizmo::HandleAt(const PictureRect& area,
                                                     const scene::Camera& camera,
                                                     const LampPlacement& lamp,
                                                     PicturePoint pointer) const {
  const ImVec2 mouse = OnScreen(area, camera, pointer);
  const auto near = [&](Vec3 point) {
    const auto seen = OnScreen(area, camera, point);
    return seen && Apart(*seen, mouse) <= kReach_px * Size();
  };
  for (const Handle handle : {Handle::kX, Handle::kY, Handle::kZ})
    if (near(ArrowTip(camera, lamp, kAxes[static_cast<int>(handle)]))) return handle;
  if (near(AimOf(lamp))) return Handle::kAim;
  return {};
}

void LampGizmo::Choose(const PictureRect& area, const scene::Camera& camera,
                       const SceneEditor& editor, PicturePoint pointer, std::size_t& chosen) {
  const ImVec2 mouse = OnScreen(area, camera, pointer);
  for (std::size_t i = 0; i < editor.lamps().size(); ++i) {
    const auto dot = OnScreen(area, camera, editor.lamps()[i].position);
    if (!dot || Apart(*dot, mouse) > kReach_px * Size()) continue;
    chosen = i;
    has_mouse_ = true;
  }
}

bool LampGizmo::Pull(const scene::Camera& camera, PicturePoint pointer, SceneEditor& editor,
                     std::size_t chosen) {
  if (grip_->handle == Handle::kAim)
    return editor.Set(chosen,
                      Aimed(grip_->lamp, BesideInPicture(camera, pointer, AimOf(grip_->lamp))));
  const Vec3 axis = kAxes[static_cast<int>(grip_->handle)].direction;
  const auto along_m = AlongAxis(camera, pointer, grip_->lamp.position, axis);
  if (!along_m) return false;
  LampPlacement moved = grip_->lamp;
  moved.position = moved.position + InMillimetres(*along_m - grip_->along_m) * axis;
  return editor.Set(chosen, moved);
}

void LampGizmo::DrawLamp(const PictureRect& area, const scene::Camera& camera,
                         const LampPlacement& lamp, std::optional<Handle> lit) const {
  const auto centre = OnScreen(area, camera, lamp.position);
  if (!centre) return;
  ImDrawList* list = ImGui::GetWindowDrawList();
  if (const auto aim = OnScreen(area, camera, AimOf(lamp))) {
    OutlinedLine(*centre, *aim, kAimColour, 1 * Size());
    const float radius = (lit == Handle::kAim ? 8 : 6) * Size();
    list->AddCircle(*aim, radius, kInk, 0, 4 * Size());
    list->AddCircle(*aim, radius, kAimColour, 0, 2 * Size());
  }
  for (const Handle handle : {Handle::kX, Handle::kY, Handle::kZ}) {
    const Arrow& axis = kAxes[static_cast<int>(handle)];
    const auto tip = OnScreen(area, camera, ArrowTip(camera, lamp, axis));
    if (!tip) continue;
    OutlinedLine(*centre, *tip, axis.colour, (lit == handle ? 3.5f : 2) * Size());
    list->AddCircleFilled(*tip, (lit == handle ? 7 : 5) * Size(), axis.colour);
    for (const auto& [shift, colour] : {std::pair{7.0f, kInk}, std::pair{6.0f, axis.colour}})
      list->AddText(ImVec2(tip->x + shift * Size(), tip->y - (12 - shift) * Size()), colour,
                    axis.name);
  }
  if (lit) OutlinedText(ImVec2(centre->x + 14 * Size(), centre->y + 14 * Size()), NumbersOf(lamp));
}

}  // namespace luxfield::view
