#include "luxfield/cli/data_file.h"

#include <filesystem>

namespace luxfield::cli {

std::string DataFile(const std::string& name) {
  const std::string here = "data/" + name;
  std::error_code error;
  if (std::filesystem::exists(here, error)) return here;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* share : {"../share", "../../share"}) {  // from bin/, from libexec/luxfield/
    const auto file = (program / share / "luxfield/data" / name).lexically_normal();
    if (std::filesystem::exists(file, error)) return file.string();
  }
  return here;
}

}  // namespace luxfield::cli
