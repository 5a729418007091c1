#include "tests/storage/disk_calls.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <map>
#include <mutex>
#include <optional>

extern "C" {
int __real_open(const char* path, int flags, mode_t mode);
int __real_close(int fd);
ssize_t __real_read(int fd, void* bytes, size_t size);
ssize_t __real_write(int fd, const void* bytes, size_t size);
int __real_ftruncate(int fd, off_t size);
int __real_fsync(int fd);
int __real_fdatasync(int fd);
int __real_rename(const char* from, const char* to);
int __real_unlink(const char* path);
int __real_mkdir(const char* path, mode_t mode);
}

namespace luxfield::disk {
namespace {

struct Recording {
  std::filesystem::path root;
  std::vector<Call> calls;
  std::map<int, std::string> paths;  // of open files and folders
};
std::optional<Recording> g_recording;

struct Planned {
  int at = 0;
  Fault fault;
  Reached reached;
};
std::optional<Planned> g_planned;

// Of the above: a session's frames are stored by threads of its own. It is held over the call
// itself, so that what is recorded comes in the order in which it was done.
std::mutex g_mutex;

// Below the recorded root, or nothing.
std::optional<std::string> Inside(const char* path) {
  if (!g_recording) return {};
  const std::string relative = std::filesystem::path(path).lexically_relative(g_recording->root);
  if (relative.empty() || relative.starts_with("..")) return {};
  return relative;
}

void Note(const Call& call) { g_recording->calls.push_back(call); }

std::optional<std::string> OpenAt(int fd) {
  if (!g_recording || !g_recording->paths.contains(fd)) return {};
  return g_recording->paths[fd];
}

// Whether this call is to fail, with errno set; `changes`: it would change the disk.
bool Fails(const char* name, bool changes) {
  if (!g_planned) return false;
  const int number = g_planned->reached.calls++;
  const bool lasts = g_planned->fault.lasting && number > g_planned->at && changes;
  if (number != g_planned->at && !lasts) return false;
  if (number == g_planned->at) g_planned->reached.failed = name;
  errno = g_planned->fault.error;
  return true;
}

int Sync(int fd, const char* name, int (*real)(int)) {
  const std::lock_guard lock(g_mutex);
  if (Fails(name, true)) return -1;
  const int result = real(fd);
  if (const auto path = OpenAt(fd); path && result == 0) Note({Call::Kind::kSync, *path});
  return result;
}

}  // namespace

std::vector<Call> Record(const std::filesystem::path& root, const std::function<void()>& work) {
  {
    const std::lock_guard lock(g_mutex);
    g_recording = Recording{root, {}, {}};
  }
  work();
  const std::lock_guard lock(g_mutex);
  std::vector<Call> calls = std::move(g_recording->calls);
  g_recording.reset();
  return calls;
}

void Mark(const std::string& text) {
  const std::lock_guard lock(g_mutex);
  if (g_recording) Note({Call::Kind::kMark, {}, {}, text});
}

void FailCall(int n, const Fault& fault) {
  const std::lock_guard lock(g_mutex);
  g_planned = Planned{n, fault, {}};
}

Reached ClearFault() {
  const std::lock_guard lock(g_mutex);
  const Reached reached = g_planned->reached;
  g_planned.reset();
  return reached;
}

}  // namespace luxfield::disk

using luxfield::disk::Call;
using namespace luxfield::disk;

extern "C" {

int __wrap_open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  const std::lock_guard lock(g_mutex);
  if (Fails("open", flags & O_CREAT)) return -1;
  const auto inside = Inside(path);
  const bool creates = inside && (flags & O_CREAT) && ::access(path, F_OK) != 0;
  const int fd = __real_open(path, flags, mode);
  if (inside && fd >= 0) {
    g_recording->paths[fd] = *inside;
    if (creates) Note({Call::Kind::kCreate, *inside});
  }
  return fd;
}

int __wrap_close(int fd) {
  const std::lock_guard lock(g_mutex);
  if (g_recording) g_recording->paths.erase(fd);
  return __real_close(fd);
}

ssize_t __wrap_read(int fd, void* bytes, size_t size) {
  const std::lock_guard lock(g_mutex);
  if (Fails("read", false)) return -1;
  return __real_read(fd, bytes, size);
}

ssize_t __wrap_write(int fd, const void* bytes, size_t size) {
  const std::lock_guard lock(g_mutex);
  if (Fails("write", true)) {
    if (errno != 0) return -1;
    size = (size + 1) / 2;
  }
  const ssize_t written = __real_write(fd, bytes, size);
  if (const auto path = OpenAt(fd); path && written > 0)
    Note({Call::Kind::kWrite,
          *path,
          {},
          std::string(static_cast<const char*>(bytes), static_cast<size_t>(written))});
  return written;
}

int __wrap_ftruncate(int fd, off_t size) {
  const std::lock_guard lock(g_mutex);
  if (Fails("ftruncate", true)) return -1;
  const int result = __real_ftruncate(fd, size);
  if (const auto path = OpenAt(fd); path && result == 0)
    Note({Call::Kind::kTruncate, *path, {}, {}, size});
  return result;
}

int __wrap_fsync(int fd) { return Sync(fd, "fsync", __real_fsync); }
int __wrap_fdatasync(int fd) { return Sync(fd, "fdatasync", __real_fdatasync); }

int __wrap_rename(const char* from, const char* to) {
  const std::lock_guard lock(g_mutex);
  if (Fails("rename", true)) return -1;
  const int result = __real_rename(from, to);
  if (const auto inside = Inside(from); inside && result == 0)
    Note({Call::Kind::kRename, *inside, *Inside(to)});
  return result;
}

int __wrap_unlink(const char* path) {
  const std::lock_guard lock(g_mutex);
  if (Fails("unlink", true)) return -1;
  const int result = __real_unlink(path);
  if (const auto inside = Inside(path); inside && result == 0) Note({Call::Kind::kRemove, *inside});
  return result;
}

int __wrap_mkdir(const char* path, mode_t mode) {
  const std::lock_guard lock(g_mutex);
  if (Fails("mkdir", true)) return -1;
  const int result = __real_mkdir(path, mode);
  if (const auto inside = Inside(path); inside && result == 0)
    Note({Call::Kind::kMakeFolder, *inside});
  return result;
}

}  // extern "C"
