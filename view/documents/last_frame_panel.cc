#include "luxfield/view/documents/last_frame_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <utility>
#include <vector>

#include "luxfield/core/file.h"
#include "luxfield/core/printable.h"
#include "luxfield/view/picture/look.h"
#include "luxfield/view/window/window.h"

namespace luxfield::view {
namespace {

constexpr std::chrono::seconds kPause{2};

std::optional<FrameLevels> Read(const std::filesystem::path& session, const std::string& file) {
  std::optional<FrameLevels> levels;
  try {
    const std::string path = (session / file).string();
    levels = LevelsOf(session::DecodeTiff(core::ReadFile(path), path), file);
  } catch (const std::exception&) {
    // The capture itself, `verify` and `report` say what is wrong with it.
  }
  Window::Wake();
  return levels;
}

std::vector<std::uint8_t> GreysOf(const core::Image& small) {
  std::vector<std::uint8_t> rgba(4 * small.plane_size(), 255);
  for (std::size_t k = 0; k < small.plane_size(); ++k)
    std::fill_n(rgba.begin() + static_cast<std::ptrdiff_t>(4 * k), 3,
                EncodeByte(double{small.data[k]}));
  return rgba;
}

}  // namespace

void LastFramePanel::Follow(const WatchedFrame& frame) {
  const auto now = std::chrono::steady_clock::now();
  if (reading_.valid()) {
    if (reading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    levels_ = reading_.get();
    if (levels_) {
      if (!texture_) texture_ = std::make_unique<ScreenTexture>();
      texture_->Show(GreysOf(levels_->small), levels_->small.width, levels_->small.height);
    }
  }
  if (frame.file == begun_ || now - begun_at_ < kPause) return;
  begun_ = frame.file;
  begun_at_ = now;
  reading_ = std::async(std::launch::async, Read, session_, frame.file);
}

void LastFramePanel::DrawLevels() {
  const float width = ImGui::GetContentRegionAvail().x;
  const float height =
      width * static_cast<float>(levels_->small.height) / static_cast<float>(levels_->small.width);
  ImGui::Image(texture_->id(), ImVec2(width, height));
  std::vector<float> heights;
  for (const double count : levels_->counts)
    heights.push_back(static_cast<float>(std::log10(1 + count)));
  ImGui::PlotHistogram("##levels", heights.data(), static_cast<int>(heights.size()), 0, nullptr, 0,
                       FLT_MAX, ImVec2(width, 4 * ImGui::GetFontSize()));
  ImGui::TextDisabled("levels from 0 to %.5g DN, pixels logarithmic", levels_->top);
}

void LastFramePanel::Draw(const WatchedFrame& frame) {
  if (!ImGui::CollapsingHeader("Last frame", ImGuiTreeNodeFlags_DefaultOpen)) return;
  ImGui::TextWrapped("%s", core::OnOneLine(frame.file).c_str());
  ImGui::Text("exposed %.4g s", frame.exposure_s);
  if (frame.brightest_dn) ImGui::Text("brightest pixel %.0f DN", *frame.brightest_dn);
  if (frame.mean_dn) ImGui::Text("mean %.1f DN", *frame.mean_dn);
  if (frame.saturated_share) ImGui::Text("saturated %.3g %%", 100 * *frame.saturated_share);
  if (levels_) DrawLevels();
}

}  // namespace luxfield::view
