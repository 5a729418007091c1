#include "luxfield/view/picture/read_picture.h"

#include <algorithm>
#include <utility>

#include "luxfield/core/exr.h"
#include "luxfield/render/film/film.h"

namespace luxfield::view {
namespace {

bool IsRendered(const std::filesystem::path& path) {
  const core::ExrReader reader(path);
  const auto& attributes = reader.parts()[0].attributes;
  const auto kind = attributes.find("luxfield:kind");
  return kind != attributes.end() && kind->second == core::ExrValue(std::string("render"));
}

// One channel as three equal ones.
core::Image InRgb(core::Image image) {
  if (image.channels == 3) return image;
  core::Image rgb(image.width, image.height, 3);
  for (int c = 0; c < 3; ++c) std::ranges::copy(image.plane(0), rgb.plane(c).begin());
  return rgb;
}

}  // namespace

render::Frame ReadPicture(const std::filesystem::path& path) {
  if (IsRendered(path)) return render::ReadFrame(path);
  render::Frame frame;
  frame.radiance = InRgb(core::ReadExrImage(path));
  frame.width = frame.radiance.width;
  frame.height = frame.radiance.height;
  return frame;
}

}  // namespace luxfield::view
