// What is kept of compiled programs: on disk under a key (core/cache.h), so that a device compiles a
// kernel once, and by an opened device, which builds each once. Internal to render/.
#pragma once

#include <fmt/format.h>

#include <map>
#include <memory>
#include <mutex>
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

class BuiltPrograms {
 public:
  // The program of these options and source, which `build` makes where there is none yet. Other
  // threads wait meanwhile.
  template <typename Build>
  std::shared_ptr<const BuiltProgram> FindOrBuild(const core::CacheKey& key, const Build& build) {
    const std::lock_guard lock(mutex_);
    auto& built = programs_[key.text];
    if (!built) built = std::make_shared<const BuiltProgram>(build());
    return built;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const BuiltProgram>> programs_;
};

}  // namespace luxfield::render
