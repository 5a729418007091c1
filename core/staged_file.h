// Atomic writing (core/file.h) in its two steps, so that other work fits between them.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

#include "core/file.h"

namespace luxfield::core {

// A file beside the one that it is to be.
class StagedFile {
 public:
  // Writes the bytes, one piece after the other, to a temporary file in the folder of `path`; the
  // disk begins with them. Throws DeviceError.
  StagedFile(const std::filesystem::path& path, std::span<const std::string_view> pieces,
             Access access);
  // The same by a writer that needs a path of its own, with the extension of `path`.
  StagedFile(const std::filesystem::path& path,
             const std::function<void(const std::filesystem::path& temporary)>& write);
  ~StagedFile();  // removes it where it was not put in place
  StagedFile(StagedFile&& other) noexcept;
  StagedFile& operator=(StagedFile&&) = delete;

  // Syncs it, renames it to `path` and syncs the folder. Once; throws DeviceError.
  void PutInPlace();

 private:
  std::filesystem::path path_, temporary_;  // temporary_ is empty once it is in place
};

}  // namespace luxfield::core
