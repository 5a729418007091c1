// An OpenEXR file in memory.
#pragma once

#include <string>

#include "luxfield/core/image.h"

namespace luxfield::core {

// The bytes of the file that WriteExrImage (exr.h) writes, without a file; messages call it `name`.
// Throws DeviceError.
std::string ExrImageBytes(const Image& image, const std::string& name);

}  // namespace luxfield::core
