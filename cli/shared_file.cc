#include "luxfield/cli/shared_file.h"

namespace luxfield::cli {

std::filesystem::path SharedFile(const std::string& name) {
  std::error_code error;
  if (std::filesystem::exists(name, error)) return name;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  // From bin/, from libexec/luxfield/, from build/PRESET/.
  for (const char* share : {"../share/luxfield", "../../share/luxfield", "../.."}) {
    const auto file = (program / share / name).lexically_normal();
    if (std::filesystem::exists(file, error)) return file;
  }
  return name;
}

}  // namespace luxfield::cli
