// What is kept of compiled programs: on disk under a key (core/cache.h), so that a device compiles a
// kernel once, and by an opened device, which builds each once. Internal to render/.
#pragma once

#include <fmt/format.h>

#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "luxfield/core/cache.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

// Device, driver and compiler by name and version, the build options and the whole source.
inline core::CacheKey ProgramKey(const DeviceInfo& device, const std::string& options,
                                 const std::string& source) {
  return {"kernel", fmt::format("{}\n{}\n{}\n{}\n{}\n{}", device.platform, device.name,
                                device.version, device.driver, options, source)};
}

// PoCL keeps what it compiles, unless it is told not to; asked for a binary it would compile every
// kernel once more, for groups of any size.
bool KeepsKernelsItself(const DeviceInfo& device);

// An embedded source, and the build options that were given with it: all options but the tuning's.
struct ProgramName {
  std::string path, options;
  auto operator<=>(const ProgramName&) const = default;
};

class BuiltPrograms {
 public:
  // The program of these options and source, which `build` makes where there is none yet. Threads
  // that want the same program wait meanwhile, others do not.
  template <typename Build>
  std::shared_ptr<const BuiltProgram> FindOrBuild(const core::CacheKey& key, const Build& build) {
    const std::shared_ptr<Entry> entry = EntryOf(key.text);
    const std::lock_guard lock(entry->mutex);
    if (!entry->built) entry->built = std::make_shared<const BuiltProgram>(build());
    return entry->built;
  }

  std::size_t count() const {  // of those that are built or being built
    const std::lock_guard lock(mutex_);
    return programs_.size();
  }

  // Programs that were asked for, as programs_ahead.h keeps them.
  void AddAsked(ProgramName name) {
    const std::lock_guard lock(mutex_);
    asked_.insert(std::move(name));
  }
  std::set<ProgramName> Asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  struct Entry {
    std::mutex mutex;
    std::shared_ptr<const BuiltProgram> built;
  };

  std::shared_ptr<Entry> EntryOf(const std::string& key) {
    const std::lock_guard lock(mutex_);
    auto& entry = programs_[key];
    if (!entry) entry = std::make_shared<Entry>();
    return entry;
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Entry>> programs_;
  std::set<ProgramName> asked_;
};

}  // namespace luxfield::render
