// What a window shows, as a PNG.
#pragma once

#include <filesystem>

#include "luxfield/view/window/window.h"

namespace luxfield::view {

// 8-bit RGB, the bytes as they are. Throws DeviceError.
void WriteScreenshot(const std::filesystem::path& path, const WindowPixels& pixels);

}  // namespace luxfield::view
