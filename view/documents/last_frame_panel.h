// The frame that a session's journal names last: its picture and how often each level occurs.
#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "luxfield/view/session/frame_levels.h"
#include "luxfield/view/session/session_watch.h"
#include "luxfield/view/window/screen_texture.h"

namespace luxfield::view {

class LastFramePanel {
 public:
  explicit LastFramePanel(std::filesystem::path session) : session_(std::move(session)) {}

  // Reads it in the background where it is another one than before, every other second at most. Files
  // of frames are whole as soon as they have their name, and are not locked. One that cannot be read
  // has no picture.
  void Follow(const WatchedFrame& frame);
  // Whether nothing is being read.
  bool ready() const { return !reading_.valid(); }
  // Draws into the ImGui window that is begun.
  void Draw(const WatchedFrame& frame);

 private:
  void DrawLevels();

  const std::filesystem::path session_;
  std::future<std::optional<FrameLevels>> reading_;
  std::string begun_;  // the file that was read last
  std::chrono::steady_clock::time_point begun_at_{};
  std::optional<FrameLevels> levels_;
  std::unique_ptr<ScreenTexture> texture_;
};

}  // namespace luxfield::view
