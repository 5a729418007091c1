#include "luxfield/view/scene_file/file_watch.h"

#include <system_error>

namespace luxfield::view {
namespace {

constexpr std::chrono::milliseconds kPause{500};

// The earliest time there is for a file that is absent.
std::filesystem::file_time_type WrittenAt(const std::filesystem::path& file) {
  std::error_code absent;
  const auto time = std::filesystem::last_write_time(file, absent);
  return absent ? std::filesystem::file_time_type::min() : time;
}

}  // namespace

void FileWatch::Watch(const std::vector<std::filesystem::path>& files) {
  files_.clear();
  for (const auto& file : files) {
    const Time time = WrittenAt(file);
    files_.push_back({file, time, time});
  }
  looked_ = std::chrono::steady_clock::now();
}

bool FileWatch::Changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < kPause) return false;
  looked_ = now;
  bool changed = false, quiet = true;
  for (Watched& watched : files_) {
    const Time time = WrittenAt(watched.file);
    quiet = quiet && time == watched.last_seen && time != Time::min();
    watched.last_seen = time;
    changed = changed || time != watched.as_it_was;
  }
  if (!changed || !quiet) return false;
  for (Watched& watched : files_) watched.as_it_was = watched.last_seen;
  return true;
}

}  // namespace luxfield::view
