#include "luxfield/session/session_path.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/core/error.h"

namespace luxfield::session {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "do not trust this session; take it from where it was captured";

}  // namespace

void CheckSessionFileName(const std::string& name, const std::string& where) {
  const fs::path path(name);
  const bool climbs =
      std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
  if (name.empty() || path.is_absolute() || climbs || name.find('\0') != std::string::npos)
    throw InputError(where, fmt::format("file = \"{}\" leaves the session folder", name), kRemedy);
}

fs::path SessionFile(const fs::path& folder, const std::string& name, const std::string& where) {
  CheckSessionFileName(name, where);
  fs::path path = folder;
  for (const fs::path& part : fs::path(name)) {
    path /= part;
    std::error_code absent;
    if (fs::is_symlink(fs::symlink_status(path, absent)))
      throw InputError(where,
                       fmt::format("\"{}\" is a symbolic link inside the session", path.string()),
                       kRemedy);
  }
  return path;
}

}  // namespace luxfield::session
