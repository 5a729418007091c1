#include "luxfield/view/panels/picture_area.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace luxfield::view {
namespace {

constexpr double kZoom = 1.15;  // a notch of the wheel
constexpr double kSmallestZoom = 0.1, kLargestZoom = 64;

// Screen pixels per pixel of the picture.
double FittingScale(const WindowSize& picture, const ImVec2& room) {
  const double fits = std::min(static_cast<double>(room.x) / picture.width,
                               static_cast<double>(room.y) / picture.height);
  return fits >= 1 ? std::floor(fits) : fits;
}

}  // namespace

void PictureArea::Draw(const Document& document, const ScreenTexture& texture) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImVec2 room = ImGui::GetContentRegionAvail();
  room = ImVec2(std::max(room.x, 1.0f), std::max(room.y, 1.0f));
  ImGui::InvisibleButton("picture", room,
                         ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight |
                             ImGuiButtonFlags_MouseButtonMiddle);
  const double scale = FittingScale(document.picture_size(), room) * zoom_.factor;
  width_ = scale * document.picture_size().width;
  height_ = scale * document.picture_size().height;
  left_ = std::floor(at.x + 0.5 * (room.x - width_) + zoom_.right * height_);
  top_ = std::floor(at.y + 0.5 * (room.y - height_) - zoom_.up * height_);
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->PushClipRect(at, ImVec2(at.x + room.x, at.y + room.y), true);
  list->AddImage(texture.id(), ImVec2(static_cast<float>(left_), static_cast<float>(top_)),
                 ImVec2(static_cast<float>(left_ + width_), static_cast<float>(top_ + height_)));
  list->PopClipRect();
  ReadMouse(document.HasCamera(), height_);
}

void PictureArea::ReadMouse(bool has_camera, double height) {
  const ImGuiIO& io = ImGui::GetIO();
  motion_ = {};
  pointer_.reset();
  double_clicked_ = false;
  hovered_ = ImGui::IsItemHovered();
  if (hovered_) {
    const double x = (io.MousePos.x - left_) / width_, y = (io.MousePos.y - top_) / height_;
    if (x >= 0 && x < 1 && y >= 0 && y < 1) pointer_ = PicturePlace{x, y};
    motion_.wheel = io.MouseWheel;
    double_clicked_ = pointer_ && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
  }
  const bool moved = io.MouseDelta.x != 0 || io.MouseDelta.y != 0;
  if (ImGui::IsItemActive() && moved) {
    using Drag = Motion::Drag;
    motion_.right = io.MouseDelta.x / height;
    motion_.up = -io.MouseDelta.y / height;
    if (ImGui::IsMouseDown(ImGuiMouseButton_Right) || io.KeyShift)
      motion_.drag = Drag::kPan;
    else if (ImGui::IsMouseDown(ImGuiMouseButton_Middle) || io.KeyCtrl)
      motion_.drag = Drag::kTurn;
    else
      motion_.drag = Drag::kOrbit;
  }
  if (has_camera) return;
  if (motion_.wheel != 0)
    zoom_.factor =
        std::clamp(zoom_.factor * std::pow(kZoom, motion_.wheel), kSmallestZoom, kLargestZoom);
  zoom_.right += motion_.right;
  zoom_.up += motion_.up;
  motion_ = {};
}

void PictureArea::MarkLine(PicturePlace from, PicturePlace to) const {
  const auto screen = [&](PicturePlace place) {
    return ImVec2(static_cast<float>(left_ + place.x * width_),
                  static_cast<float>(top_ + place.y * height_));
  };
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddLine(screen(from), screen(to), IM_COL32(0, 0, 0, 160), 3);
  list->AddLine(screen(from), screen(to), IM_COL32(255, 255, 255, 200), 1);
}

void PictureArea::Mark(PicturePlace place, int number) const {
  const ImVec2 at(static_cast<float>(left_ + place.x * width_),
                  static_cast<float>(top_ + place.y * height_));
  const float arm = 0.4f * ImGui::GetFontSize();
  ImDrawList* list = ImGui::GetWindowDrawList();
  for (const auto& [colour, thick] :
       {std::pair{IM_COL32(0, 0, 0, 200), 3.0f}, std::pair{IM_COL32(255, 255, 255, 255), 1.0f}}) {
    list->AddLine(ImVec2(at.x - arm, at.y), ImVec2(at.x + arm, at.y), colour, thick);
    list->AddLine(ImVec2(at.x, at.y - arm), ImVec2(at.x, at.y + arm), colour, thick);
  }
  const std::string text = std::to_string(number);
  list->AddText(ImVec2(at.x + arm + 1, at.y + 1), IM_COL32(0, 0, 0, 255), text.c_str());
  list->AddText(ImVec2(at.x + arm, at.y), IM_COL32(255, 255, 255, 255), text.c_str());
}

}  // namespace luxfield::view
