#include "luxfield/render/device/program_cache.h"

#include <fmt/format.h>

#include <filesystem>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/outputs.h"

namespace luxfield::render {
namespace {

std::filesystem::path CacheFile(const std::string& name, const std::string& key) {
  return core::CacheFile(fmt::format(
      "{}-{:08x}.clbin", std::filesystem::path(name).filename().string(), core::Crc32c(key)));
}

std::string Header(const std::string& key, const std::string& binary) {
  return fmt::format("luxfield program 1 {} {} {:08x}\n", key.size(), binary.size(),
                     core::Crc32c(key + binary));
}

}  // namespace

std::string ProgramKey(const DeviceInfo& device, const std::string& options,
                       const std::string& source) {
  return fmt::format("{}\n{}\n{}\n{}\n{}\n{}", device.platform, device.name, device.version,
                     device.driver, options, source);
}

std::string LoadProgramBinary(const std::string& name, const std::string& key) {
  const auto path = CacheFile(name, key);
  std::error_code ignored;
  if (path.empty() || !std::filesystem::exists(path, ignored)) return {};
  try {
    const std::string content = core::ReadFile(path);
    const auto line_end = content.find('\n');
    if (line_end == std::string::npos || content.compare(line_end + 1, key.size(), key) != 0)
      return {};
    std::string binary = content.substr(line_end + 1 + key.size());
    return content.starts_with(Header(key, binary)) ? binary : std::string();
  } catch (const Error&) {
    return {};
  }
}

void StoreProgramBinary(const std::string& name, const std::string& key,
                        const std::string& binary) {
  const auto path = CacheFile(name, key);
  if (path.empty() || binary.empty()) return;
  core::WriteCacheFile(path, Header(key, binary) + key + binary);  // else the next process compiles
}

}  // namespace luxfield::render
