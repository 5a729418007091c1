// Atomic writing (core/file.h) in its steps, so that other work fits between them.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/file.h"

namespace luxfield::core {

// Throws InputError where `path` is a folder, a pipe, a device or a socket, or a link to one: a file
// does not take their place. Returns it.
const std::filesystem::path& RequireReplaceable(const std::filesystem::path& path);

// A file beside the one that it is to be, locked (flock(2)) for as long as it waits. What has its
// name then has to be replaceable, at the beginning and when the name changes hands.
class StagedFile {
 public:
  // Writes the bytes, one piece after the other, to a temporary file in the folder of `path`; the
  // disk begins with them. Throws InputError and DeviceError, as what follows does.
  StagedFile(const std::filesystem::path& path, std::span<const std::string_view> pieces,
             Access access);
  // The same by a writer that needs a path of its own, with the extension of `path`. The file is
  // there already, and empty.
  StagedFile(const std::filesystem::path& path,
             const std::function<void(const std::filesystem::path& temporary)>& write);
  ~StagedFile();  // removes it where it was not put in place
  StagedFile(StagedFile&& other) noexcept;
  StagedFile& operator=(StagedFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::filesystem::path& temporary() const { return temporary_; }  // where it waits

  // Syncs it, renames it to `path` and syncs the folder; where that fails a new name goes again.
  // Once.
  void PutInPlace();

  // The same in steps, for several files together: Sync each, Exchange each, sync their folders.
  void Sync() const;
  void Exchange();       // a file that had the name before waits until this one is destroyed,
  void Undo() noexcept;  // or gets its name back, if it waits

 private:
  StagedFile(const std::filesystem::path& path, Access access);
  void Rename();

  std::filesystem::path path_, temporary_;  // temporary_ is empty where nothing waits there
  Descriptor file_;
  bool fresh_ = false;  // in place, where nothing was
};

// Whether a file is named like those that wait: .STEM.PID-N.tmp.EXTENSION, hidden.
bool IsTemporaryName(const std::string& name);

// Removes the temporary files that killed processes left in `folder`: those that nobody holds the
// lock of and whose process does not live here, or that nothing has been written to for a day.
// What cannot be removed stays.
void SweepTemporaries(const std::filesystem::path& folder);

}  // namespace luxfield::core
