// Planar float images.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace luxfield::core {

// `channels` planes of height x width float32, row 0 on top:
//
//   data[(channel * height + row) * width + column]
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<float> data;

  Image() = default;
  Image(int width_, int height_, int channels_)
      : width(width_),
        height(height_),
        channels(channels_),
        data(static_cast<std::size_t>(width_) * height_ * channels_, 0.0f) {}

  std::size_t plane_size() const { return static_cast<std::size_t>(width) * height; }
  float& at(int channel, int row, int column) {
    return data[(static_cast<std::size_t>(channel) * height + row) * width + column];
  }
  float at(int channel, int row, int column) const {
    return data[(static_cast<std::size_t>(channel) * height + row) * width + column];
  }
  std::span<float> plane(int channel) {
    return std::span(data).subspan(plane_size() * channel, plane_size());
  }
  std::span<const float> plane(int channel) const {
    return std::span(data).subspan(plane_size() * channel, plane_size());
  }
};

}  // namespace luxfield::core
