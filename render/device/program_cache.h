// What a compiled program is kept under (core/cache.h), so that a device compiles a kernel once.
// Internal to render/.
#pragma once

#include <fmt/format.h>

#include <string>

#include "luxfield/core/cache.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

// Device, driver and compiler by name and version, the build options and the whole source.
inline core::CacheKey ProgramKey(const DeviceInfo& device, const std::string& options,
                                 const std::string& source) {
  return {"kernel", fmt::format("{}\n{}\n{}\n{}\n{}\n{}", device.platform, device.name,
                                device.version, device.driver, options, source)};
}

}  // namespace luxfield::render
