// Folders that processes write in while they work on a shard.
//
//   FOLDER/scratch/7.HOST.PID-XXXXXX/   shard 7; XXXXXX sets apart those of equal host and process;
//                                       hidden (.7.HOST...) until it is locked
//
// Two containers may have equal host names and process numbers, and neither sees the other's
// processes. A process holds the lock (flock(2)) of the file LOCK in its folder as long as it works.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::shard {

// A folder of this process, which is removed at its end.
class ScratchFolder {
 public:
  // Throws DeviceError.
  ScratchFolder(const std::filesystem::path& folder, int number);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

// A folder of a process that works, or worked, on a shard.
struct Scratch {
  std::filesystem::path folder;
  int number = 0;
  std::string host;
  long process = 0;
  bool here = false;   // on this host
  bool alive = false;  // only known of this host
};
std::vector<Scratch> FindScratch(const std::filesystem::path& folder);

// Removes those of this host whose process is gone, and those that are hidden since a day.
void SweepScratch(const std::filesystem::path& folder);

std::string HostName();

}  // namespace luxfield::shard
