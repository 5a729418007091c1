// One process at a time in a folder.
#pragma once

#include <filesystem>

namespace luxfield::session {

// Holds FOLDER/LOCK (flock) until destruction; a killed process frees it. The file's text (pid and
// host) only informs.
class FolderLock {
 public:
  explicit FolderLock(
      const std::filesystem::path& folder);  // InputError if another process holds it
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
};

// Whether a process holds it now; creates nothing, and says no where it cannot tell.
bool FolderInUse(const std::filesystem::path& folder);

}  // namespace luxfield::session
