#include "luxfield/session/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "luxfield/core/error.h"

namespace luxfield::session {

FolderLock::FolderLock(const std::filesystem::path& folder) {
  const auto path = folder / "LOCK";
  fd_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (fd_ < 0)
    throw DeviceError(fmt::format("{}: cannot create: {}; check the folder's permissions",
                                  path.string(), std::strerror(errno)));
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd_);
    throw InputError(folder.string(), "is in use by another process", "wait for it or stop it");
  }
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string text = fmt::format("pid {} on {}\n", ::getpid(), host.data());
  if (::ftruncate(fd_, 0) == 0) (void)!::pwrite(fd_, text.data(), text.size(), 0);
}

FolderLock::~FolderLock() { ::close(fd_); }

bool FolderInUse(const std::filesystem::path& folder) {
  const int fd = ::open((folder / "LOCK").c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) return false;
  const bool in_use = ::flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(fd);
  return in_use;
}

}  // namespace luxfield::session
