#include "luxfield/view/window/screen_texture.h"

#include <GLFW/glfw3.h>

#include <cstdint>

namespace luxfield::view {

ScreenTexture::ScreenTexture() {
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  Smooth(false);
}

ScreenTexture::~ScreenTexture() { glDeleteTextures(1, &texture_); }

void ScreenTexture::Show(std::span<const std::uint8_t> rgba, int width, int height) {
  glBindTexture(GL_TEXTURE_2D, texture_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
               rgba.data());
  width_ = width;
  height_ = height;
}

void ScreenTexture::Smooth(bool smooth) {
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, smooth ? GL_LINEAR : GL_NEAREST);
}

void* ScreenTexture::id() const {
  return reinterpret_cast<void*>(static_cast<std::uintptr_t>(texture_));
}

}  // namespace luxfield::view
