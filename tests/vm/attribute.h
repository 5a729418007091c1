// Files of sysfs and configfs: one value each.
#pragma once

#include <filesystem>
#include <string>

namespace luxfield::vm {

// In one write(2), as the kernel wants it. Throws std::system_error with the path.
void WriteAttribute(const std::filesystem::path& path, const std::string& value);
// Without its line feed. Throws std::system_error with the path.
std::string ReadAttribute(const std::filesystem::path& path);

}  // namespace luxfield::vm
