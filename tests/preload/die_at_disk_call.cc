// Preloaded into the program: ends it with SIGKILL at the n-th call that changes the disk below a
// folder, LUXFIELD_DIE_AT = n >= 0 and LUXFIELD_DIE_BELOW = its path. The call is not made; of a
// write the first half is.
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cstdarg>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

bool IsBelow(std::string_view path) {
  static const char* const folder = std::getenv("LUXFIELD_DIE_BELOW");
  return folder && path.starts_with(folder);
}

bool IsBelow(int descriptor) {
  char path[PATH_MAX];
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t size = readlink(link.c_str(), path, sizeof path);
  return size > 0 && IsBelow(std::string_view(path, static_cast<std::size_t>(size)));
}

// Whether this is the call, of those that concern the folder.
bool IsTheLast(bool concerned) {
  static std::atomic<int> left = [] {
    const char* at = std::getenv("LUXFIELD_DIE_AT");
    return at ? std::atoi(at) : INT_MAX;
  }();
  return concerned && left-- == 0;
}

void Die() { kill(getpid(), SIGKILL); }

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  if (IsTheLast((flags & O_CREAT) && IsBelow(path))) Die();
  static const auto next = Next<int(const char*, int, ...)>("open");
  return next(path, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, std::size_t size) {
  static const auto next = Next<ssize_t(int, const void*, std::size_t)>("write");
  if (IsTheLast(IsBelow(descriptor))) {
    next(descriptor, bytes, size / 2);
    Die();
  }
  return next(descriptor, bytes, size);
}

int fsync(int descriptor) {
  if (IsTheLast(IsBelow(descriptor))) Die();
  static const auto next = Next<int(int)>("fsync");
  return next(descriptor);
}

int fdatasync(int descriptor) {
  if (IsTheLast(IsBelow(descriptor))) Die();
  static const auto next = Next<int(int)>("fdatasync");
  return next(descriptor);
}

int rename(const char* from, const char* to) noexcept {
  if (IsTheLast(IsBelow(to))) Die();
  static const auto next = Next<int(const char*, const char*)>("rename");
  return next(from, to);
}

int unlink(const char* path) noexcept {
  if (IsTheLast(IsBelow(path))) Die();
  static const auto next = Next<int(const char*)>("unlink");
  return next(path);
}

int mkdir(const char* path, mode_t mode) noexcept {
  if (IsTheLast(IsBelow(path))) Die();
  static const auto next = Next<int(const char*, mode_t)>("mkdir");
  return next(path, mode);
}

int ftruncate(int descriptor, off_t size) noexcept {
  if (IsTheLast(IsBelow(descriptor))) Die();
  static const auto next = Next<int(int, off_t)>("ftruncate");
  return next(descriptor, size);
}

}  // extern "C"
