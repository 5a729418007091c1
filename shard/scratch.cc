#include "luxfield/shard/scratch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"

namespace luxfield::shard {
namespace {

namespace fs = std::filesystem;

constexpr char kLock[] = "LOCK";

[[noreturn]] void FailMaking(const fs::path& path) {
  throw DeviceError(fmt::format("{}: cannot create: {}; free space or check who may write there",
                                path.string(), std::strerror(errno)));
}

bool IsOld(const fs::path& folder) {
  constexpr std::time_t kDay = 24 * 3600;
  struct stat status {};
  return ::stat(folder.c_str(), &status) == 0 && std::time(nullptr) - status.st_mtime > kDay;
}

// Whether the process that the folder is of works there yet. The process number alone decides where
// the file system has no locks, the lock is another user's, or an earlier version made the folder.
bool IsAlive(const fs::path& folder, long process) {
  const int file = ::open((folder / kLock).c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file >= 0) {
    const bool is_free = ::flock(file, LOCK_SH | LOCK_NB) == 0;
    const bool is_held = !is_free && errno == EWOULDBLOCK;
    ::close(file);
    if (is_free || is_held) return is_held;
  }
  return ::kill(static_cast<pid_t>(process), 0) == 0 || errno == EPERM;
}

// Takes the number that a text begins with off it. Whether there was one.
template <typename Number>
bool TakeNumber(std::string_view& text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

// NUMBER.HOST.PID, and what follows the PID is free; HOST may have points.
bool ParseName(std::string_view name, Scratch& scratch) {
  if (!TakeNumber(name, scratch.number) || !name.starts_with('.')) return false;
  const std::size_t last = name.rfind('.');
  if (last == 0) return false;
  scratch.host = name.substr(1, last - 1);
  name.remove_prefix(last + 1);
  return TakeNumber(name, scratch.process) && (name.empty() || name.starts_with('-'));
}

}  // namespace

std::string HostName() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

ScratchFolder::ScratchFolder(const fs::path& folder, int number) {
  const fs::path scratch = folder / "scratch";
  core::MakeFolder(scratch);
  // Hidden until it is locked: nobody takes it for what a dead process left.
  const std::string name = fmt::format(".{}.{}.{}-XXXXXX", number, HostName(), ::getpid());
  std::string hidden = scratch / name;
  if (!::mkdtemp(hidden.data())) FailMaking(hidden);
  path_ = scratch / fs::path(hidden).filename().string().substr(1);
  lock_ = ::open((fs::path(hidden) / kLock).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (lock_ >= 0) ::flock(lock_, LOCK_EX | LOCK_NB);  // where the file system has locks
  if (lock_ >= 0 && ::rename(hidden.c_str(), path_.c_str()) == 0) return;
  const int error = errno;
  std::error_code ignored;
  fs::remove_all(hidden, ignored);
  if (lock_ >= 0) ::close(lock_);
  errno = error;
  FailMaking(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

std::vector<Scratch> FindScratch(const fs::path& folder) {
  std::vector<Scratch> all;
  std::error_code error;
  for (auto entry = fs::directory_iterator(folder / "scratch", error);
       !error && entry != end(entry); entry.increment(error)) {
    Scratch scratch;
    if (!ParseName(entry->path().filename().string(), scratch)) continue;
    scratch.folder = entry->path();
    scratch.here = scratch.host == HostName();
    scratch.alive = scratch.here && IsAlive(scratch.folder, scratch.process);
    all.push_back(scratch);
  }
  return all;
}

void SweepScratch(const fs::path& folder) {
  std::error_code ignored;
  for (const Scratch& scratch : FindScratch(folder))
    if (scratch.here && !scratch.alive) fs::remove_all(scratch.folder, ignored);
  std::vector<fs::path> unlocked;  // since a day: whoever made them was killed before the lock
  for (const auto& entry : fs::directory_iterator(folder / "scratch", ignored))
    if (entry.path().filename().string().starts_with('.') && IsOld(entry.path()))
      unlocked.push_back(entry.path());
  for (const fs::path& path : unlocked) fs::remove_all(path, ignored);
}

}  // namespace luxfield::shard
