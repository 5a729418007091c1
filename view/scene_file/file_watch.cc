#include "luxfield/view/scene_file/file_watch.h"

#include <algorithm>
#include <system_error>
#include <utility>

namespace luxfield::view {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPause{500};

// The earliest time there is for a file that is absent.
fs::file_time_type WrittenAt(const fs::path& file) {
  std::error_code absent;
  const auto time = fs::last_write_time(file, absent);
  return absent ? fs::file_time_type::min() : time;
}

}  // namespace

void FileWatch::Watch(const std::vector<fs::path>& files) {
  std::vector<Watched> watched;
  for (const fs::path& file : files) {
    const auto known = std::ranges::find(files_, file, &Watched::file);
    const Time time = WrittenAt(file);
    watched.push_back(known == files_.end() ? Watched{file, time, time} : *known);
  }
  files_ = std::move(watched);
  looked_ = std::chrono::steady_clock::now();
}

void FileWatch::Accept(const fs::path& file) {
  const auto watched = std::ranges::find(files_, file, &Watched::file);
  if (watched != files_.end()) watched->as_it_was = watched->last_seen = WrittenAt(file);
}

bool FileWatch::Changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < kPause) return false;
  looked_ = now;
  bool changed = false, quiet = true;
  for (Watched& watched : files_) {
    const Time time = WrittenAt(watched.file);
    quiet = quiet && time == watched.last_seen;
    watched.last_seen = time;
    changed = changed || (time != watched.as_it_was && time != Time::min());
  }
  if (!changed || !quiet) return false;
  for (Watched& watched : files_) watched.as_it_was = watched.last_seen;
  return true;
}

}  // namespace luxfield::view
