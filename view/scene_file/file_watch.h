// Files that others may write while they are looked at.
#pragma once

#include <chrono>
#include <filesystem>
#include <utility>
#include <vector>

namespace luxfield::view {

class FileWatch {
 public:
  // From now on these, some of which may be absent: those that are watched already as they were when
  // Changed said so last, the others as they are.
  void Watch(const std::vector<std::filesystem::path>& files);
  // This one as it is now, no matter who wrote it.
  void Accept(const std::filesystem::path& file);
  // Whether one of them was written since; looks twice a second at most. A file that is written again
  // and again counts once it has stayed the same for that time, and one that is absent when it is back.
  bool Changed();

 private:
  using Time = std::filesystem::file_time_type;
  struct Watched {
    std::filesystem::path file;
    Time as_it_was, last_seen;
  };
  std::vector<Watched> files_;
  std::chrono::steady_clock::time_point looked_;
};

}  // namespace luxfield::view
