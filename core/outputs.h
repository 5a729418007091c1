// The files that a verb writes: all of them come into being at its end, or none does.
#pragma once

#include <filesystem>
#include <set>
#include <string_view>
#include <vector>

#include "luxfield/core/staged_file.h"

namespace luxfield::core {

// While one lives, what WriteAtomically and WriteFileAtomically write (core/file.h) waits beside
// its place; one at a time, for the whole process.
//
// The first file that waits in a folder sweeps it (core/staged_file.h).
class Outputs {
 public:
  Outputs();
  ~Outputs();  // removes what waits
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  // Syncs all that waits, renames all and syncs their folders. Where that fails, the renames are
  // undone: what was there before is there again. A process that is killed between two renames
  // leaves some of the files in place, whole, and the others not. Throws DeviceError, and InputError
  // where something else than a file has got one of the names.
  void PutInPlace();

 private:
  friend void Place(StagedFile file);
  friend std::filesystem::path ReadableAt(const std::filesystem::path& path);
  std::vector<StagedFile> waiting_;
  std::set<std::filesystem::path> swept_;
};

// While one lives, files come into being as they are written, whatever outputs wait: for scratch
// that is read again.
class WritesAtOnce {
 public:
  WritesAtOnce();
  ~WritesAtOnce();
  WritesAtOnce(const WritesAtOnce&) = delete;
  WritesAtOnce& operator=(const WritesAtOnce&) = delete;

 private:
  Outputs* waiting_;
};

// Of a sequence, whose frames are whole one by one: puts in place what waits, if any does.
void PutOutputsInPlace();

// Puts it in place, or hands it to the Outputs that lives. Throws InputError where two outputs have
// one name, and as StagedFile does.
void Place(StagedFile file);

// Where a file can be read that the verb may have written: where it waits, else at `path`.
std::filesystem::path ReadableAt(const std::filesystem::path& path);

// Writes a file that can be made again (CacheFile in core/file.h) at once, whatever outputs wait,
// and makes its folder. Whether that worked.
bool WriteCacheFile(const std::filesystem::path& path, std::string_view bytes);

// For a file that belongs to `output`, which the user names, and gets its name from it: that what has
// this name already is such a file, as the bytes `mark` tell, which each of them holds. Throws
// InputError.
void RequireOwn(const std::filesystem::path& path, const std::filesystem::path& output,
                std::string_view mark);

// For the beginning of a verb: that `path` can be written. Throws InputError where its folder is
// missing or is none, or where something else than a file has its name; DeviceError where the
// folder takes no files.
void RequireOutputPlace(const std::filesystem::path& path);

}  // namespace luxfield::core
