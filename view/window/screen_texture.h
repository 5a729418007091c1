// A picture's colours on the graphics card.
#pragma once

#include <cstdint>
#include <span>

namespace luxfield::view {

// An OpenGL texture of 8-bit RGBA; lives while the window's context does.
class ScreenTexture {
 public:
  ScreenTexture();
  ~ScreenTexture();
  ScreenTexture(const ScreenTexture&) = delete;
  ScreenTexture& operator=(const ScreenTexture&) = delete;

  // width x height pixels of four bytes, row 0 on top.
  void Show(std::span<const std::uint8_t> rgba, int width, int height);
  // Whether pixels that are shown larger than they are blend into each other; those shown smaller
  // always do.
  void Smooth(bool smooth);

  // As ImGui::Image takes it.
  void* id() const;
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  unsigned texture_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace luxfield::view
