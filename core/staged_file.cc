#include "core/staged_file.h"

#include <fcntl.h>

#include <atomic>
#include <utility>

#include "core/descriptor.h"

namespace luxfield::core {
namespace {

void WriteAll(int fd, std::string_view bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      FailWriting(path, "write");
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

// Unique within the folder for this process; keeps the extension, since image writers go by it.
std::filesystem::path TemporaryBeside(const std::filesystem::path& path) {
  static std::atomic<unsigned> counter{0};
  return FolderOf(path) / fmt::format(".{}.{}-{}.tmp{}", path.stem().string(), ::getpid(),
                                      counter++, path.extension().string());
}

// Failures name the file that it is to be.
void WriteNew(const std::filesystem::path& temporary, std::span<const std::string_view> pieces,
              Access access, const std::filesystem::path& path) {
  const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                               access == Access::kPrivate ? 0600 : 0666));
  if (file.get() < 0) FailWriting(path, "create");
  for (const std::string_view bytes : pieces) WriteAll(file.get(), bytes, path);
  // Only sooner than the sync would: what it says does not matter.
  ::sync_file_range(file.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
}

}  // namespace

StagedFile::StagedFile(const std::filesystem::path& path,
                       const std::function<void(const std::filesystem::path&)>& write)
    : path_(path), temporary_(TemporaryBeside(path)) {
  try {
    write(temporary_);
    StorageStep("temporary written");
  } catch (...) {
    ::unlink(temporary_.c_str());
    throw;
  }
}

StagedFile::StagedFile(const std::filesystem::path& path, std::span<const std::string_view> pieces,
                       Access access)
    : StagedFile(path, [&](const std::filesystem::path& temporary) {
        WriteNew(temporary, pieces, access, path);
      }) {}

StagedFile::StagedFile(StagedFile&& other) noexcept
    : path_(std::move(other.path_)), temporary_(std::exchange(other.temporary_, {})) {}

StagedFile::~StagedFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void StagedFile::PutInPlace() {
  const Descriptor file(::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0 || ::fsync(file.get()) != 0) FailWriting(path_, "sync");
  StorageStep("temporary synced");
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) FailWriting(path_, "rename into place");
  temporary_.clear();
  StorageStep("renamed");
  SyncFolder(FolderOf(path_));
  StorageStep("folder synced");
}

}  // namespace luxfield::core
