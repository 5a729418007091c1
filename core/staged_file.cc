#include "luxfield/core/staged_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <atomic>
#include <cerrno>
#include <ctime>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

// Unique within the folder for this process; keeps the extension, since image writers go by it.
fs::path TemporaryBeside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return FolderOf(path) / fmt::format(".{}.{}-{}.tmp{}", path.stem().string(), ::getpid(),
                                      counter++, path.extension().string());
}

// Names `temporary` and makes it. A process of another container may have this one's number, and a
// file of that name.
int MakeTemporary(const fs::path& path, mode_t mode, fs::path& temporary) {
  constexpr int kTries = 1000;
  int file = -1;
  for (int k = 0; file < 0 && k < kTries; ++k) {
    temporary = TemporaryBeside(path);
    file = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (file < 0 && errno != EEXIST) break;
  }
  return file;
}

// The number that a text begins with, of at most `most` digits, which it takes off; none otherwise.
std::optional<long> TakeNumber(std::string_view& text, std::size_t most) {
  long number = 0;
  std::size_t digits = 0;
  for (; digits < text.size() && text[digits] >= '0' && text[digits] <= '9'; ++digits)
    if (digits < most) number = 10 * number + (text[digits] - '0');
  if (digits == 0 || digits > most) return std::nullopt;
  text.remove_prefix(digits);
  return number;
}

// The process that a temporary file is named after, or 0 where the name is none of ours:
// .NAME.PID-NUMBER.tmp, or that and an extension.
pid_t WriterOf(std::string_view name) {
  if (!name.starts_with('.')) return 0;
  const std::size_t end = name.rfind(".tmp");
  if (end == std::string_view::npos) return 0;
  const std::string_view extension = name.substr(end + 4);
  if (!extension.empty() &&
      (extension[0] != '.' || extension.find('.', 1) != std::string_view::npos))
    return 0;
  const std::string_view before = name.substr(0, end);
  const std::size_t dot = before.rfind('.');
  if (dot == 0 || dot == std::string_view::npos) return 0;
  std::string_view rest = before.substr(dot + 1);
  if (rest.starts_with('0')) return 0;
  const auto pid = TakeNumber(rest, 9);
  if (!pid || !rest.starts_with('-')) return 0;
  rest.remove_prefix(1);
  return TakeNumber(rest, 10) && rest.empty() ? static_cast<pid_t>(*pid) : 0;
}

// Between a file's creation and its lock only the process says that somebody writes it, and
// processes of other machines or containers cannot be seen.
bool IsOrphan(const fs::path& path, pid_t writer) {
  constexpr std::time_t kDay = 24 * 3600;
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  const bool dead = ::kill(writer, 0) != 0 && errno == ESRCH;
  if (!dead && std::time(nullptr) - status.st_mtime < kDay) return false;
  return ::flock(file.get(), LOCK_EX | LOCK_NB) == 0;
}

}  // namespace

const fs::path& RequireReplaceable(const fs::path& path) {
  std::error_code unknown;
  const auto there = fs::status(path, unknown);
  if (fs::is_directory(there))
    throw InputError(path.string(), "is a folder, not a file to write", "name a file in it");
  if (fs::exists(there) && !fs::is_regular_file(there))
    throw InputError(path.string(), "is no file that can be replaced", "name another");
  return path;
}

StagedFile::StagedFile(const fs::path& path, Access access)
    : path_(RequireReplaceable(path)),
      file_(MakeTemporary(path, access == Access::kPrivate ? 0600 : 0666, temporary_)) {
  if (file_.get() < 0) {
    temporary_.clear();
    FailWriting(path, "create");  // names the file that it is to be
  }
  ::flock(file_.get(), LOCK_EX | LOCK_NB);  // where the file system has locks
}

// From here on the destructor runs, whatever is thrown.
StagedFile::StagedFile(const fs::path& path, const std::function<void(const fs::path&)>& write)
    : StagedFile(path, Access::kUmask) {
  write(temporary_);
  struct stat status {};
  if (::fstat(file_.get(), &status) != 0 || status.st_size == 0)
    throw DeviceError(fmt::format("{}: nothing was written", path.string()));
  StorageStep("temporary written");
}

StagedFile::StagedFile(const fs::path& path, std::span<const std::string_view> pieces,
                       Access access)
    : StagedFile(path, access) {
  for (const std::string_view bytes : pieces) WriteAll(file_.get(), bytes, path);
  // Only sooner than the sync would: what it says does not matter.
  ::sync_file_range(file_.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
  StorageStep("temporary written");
}

StagedFile::StagedFile(StagedFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(other.file_.release()),
      fresh_(other.fresh_) {}

StagedFile::~StagedFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void StagedFile::Sync() const {
  if (::fsync(file_.get()) != 0) FailWriting(path_, "sync");
  StorageStep("temporary synced");
}

void StagedFile::Rename() {
  RequireReplaceable(path_);
  struct stat there {};
  fresh_ = ::lstat(path_.c_str(), &there) != 0;
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) FailWriting(path_, "rename into place");
  temporary_.clear();
  StorageStep("renamed");
}

void StagedFile::PutInPlace() {
  Sync();
  Rename();
  try {
    SyncFolder(FolderOf(path_));
  } catch (...) {
    Undo();
    throw;
  }
  StorageStep("folder synced");
}

void StagedFile::Exchange() {
  RequireReplaceable(path_);
  struct stat there {};
  const bool replaces = ::lstat(path_.c_str(), &there) == 0;
  // Not every file system exchanges; there the old file goes at once.
  if (!replaces ||
      ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE) != 0)
    return Rename();
  StorageStep("renamed");
}

void StagedFile::Undo() noexcept {
  if (fresh_)
    ::unlink(path_.c_str());
  else if (!temporary_.empty())
    ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE);
}

bool IsTemporaryName(const std::string& name) { return WriterOf(name) != 0; }

void SweepTemporaries(const fs::path& folder) {
  std::error_code error;
  for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::end(entry);
       entry.increment(error)) {
    const pid_t writer = WriterOf(entry->path().filename().string());
    if (writer != 0 && IsOrphan(entry->path(), writer)) ::unlink(entry->path().c_str());
  }
}

}  // namespace luxfield::core
