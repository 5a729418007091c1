// Pictures to look at, from files.
#pragma once

#include <filesystem>

#include "luxfield/render/film/frame.h"

namespace luxfield::view {

// A file of `luxfield render` with all its layers, or any other OpenEXR picture with channels R, G, B
// or Y as a frame of radiance alone: its unit is relative, its other images are empty. Throws
// InputError for files that are absent, damaged or no pictures.
render::Frame ReadPicture(const std::filesystem::path& path);

}  // namespace luxfield::view
