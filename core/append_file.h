// Files that grow at their end.
#pragma once

#include <filesystem>
#include <string_view>

namespace luxfield::core {

// Adds bytes to the end of a file that is there, and syncs it. Throws DeviceError, and then some of
// them may be there.
void AppendToFile(const std::filesystem::path& path, std::string_view bytes);

}  // namespace luxfield::core
