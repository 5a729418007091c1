#include "luxfield/core/cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <span>
#include <vector>

#include "luxfield/core/build_id.h"
#include "luxfield/core/descriptor.h"
#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/staged_file.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

constexpr char kMagic[] = "luxfield cache 1";
constexpr char kLimitName[] = "limit";
constexpr std::uint64_t kDefaultLimit = std::uint64_t{1} << 30;
constexpr std::uint64_t kLargestShare = 4;  // of the limit, that one value may take
constexpr double kLeftShare = 0.9;          // of the limit, after an eviction
constexpr std::size_t kLongestLine = 256;

bool IsOff() {
  const char* const setting = std::getenv("LUXFIELD_CACHE");
  return setting && std::string_view(setting) == "off";
}

// Whether nobody else can have put something there.
bool IsOfThisUserAlone(const struct stat& status) {
  return status.st_uid == ::geteuid() && (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

// Why a folder is not used; empty: it is, or it is not there yet.
std::string Obstacle(const fs::path& folder) {
  if (IsOff()) return "LUXFIELD_CACHE is off";
  if (folder.empty()) return "neither XDG_CACHE_HOME nor HOME is set";
  struct stat status {};
  if (::lstat(folder.c_str(), &status) != 0)
    return errno == ENOENT ? std::string()
                           : fmt::format("it cannot be read ({})", std::strerror(errno));
  if (!S_ISDIR(status.st_mode)) return "it is no folder";
  if (!IsOfThisUserAlone(status)) return "another user owns it or may write to it";
  return {};
}

fs::path Folder() { return CacheFile("store"); }

std::string NameOf(const CacheKey& key) {
  return Sha256(key.kind + "\n" + key.text) + "." + key.kind;
}

// The kind of an entry by its file's name; empty: it is none.
std::string KindOf(const std::string& name) {
  constexpr std::size_t kHash = 64;
  if (name.size() <= kHash + 1 || name[kHash] != '.') return {};
  const bool hexadecimal = std::all_of(name.begin(), name.begin() + kHash, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
  });
  return hexadecimal ? name.substr(kHash + 1) : std::string();
}

struct Entry {
  fs::path path;
  std::string kind;
  std::uint64_t bytes = 0;
  timespec used{};
};

std::vector<Entry> Entries(const fs::path& folder) {
  std::vector<Entry> entries;
  std::error_code error;
  for (auto at = fs::directory_iterator(folder, error); !error && at != fs::end(at);
       at.increment(error)) {
    struct stat status {};
    const std::string kind = KindOf(at->path().filename().string());
    if (!kind.empty() && ::lstat(at->path().c_str(), &status) == 0)
      entries.push_back(
          {at->path(), kind, static_cast<std::uint64_t>(status.st_size), status.st_mtim});
  }
  return entries;
}

std::uint64_t Limit(const fs::path& folder) {
  try {
    const std::string text = ReadFile(folder / kLimitName);
    std::uint64_t bytes = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bytes);
    if (error == std::errc() && bytes > 0) return bytes;
  } catch (const Error&) {
  }
  return kDefaultLimit;
}

// Removes what was not used for longest until the rest keeps the limit with some room.
void Evict(const fs::path& folder, std::uint64_t limit) {
  std::vector<Entry> entries = Entries(folder);
  std::uint64_t bytes = 0;
  for (const Entry& entry : entries) bytes += entry.bytes;
  if (bytes <= limit) return;
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.used.tv_sec != b.used.tv_sec ? a.used.tv_sec < b.used.tv_sec
                                          : a.used.tv_nsec < b.used.tv_nsec;
  });
  const auto left = static_cast<std::uint64_t>(kLeftShare * static_cast<double>(limit));
  for (const Entry& entry : entries) {
    if (bytes <= left) return;
    ::unlink(entry.path.c_str());
    bytes -= entry.bytes;
  }
}

std::string Header(const CacheKey& key, std::string_view value) {
  return fmt::format("{} {} {} {}\n", kMagic, key.text.size(), value.size(), Sha256(value));
}

// Up to `count` bytes from an offset on.
std::string ReadAt(int fd, std::size_t offset, std::size_t count) {
  std::string bytes(count, '\0');
  std::size_t done = 0;
  while (done < count) {
    const ssize_t more =
        ::pread(fd, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (more < 0 && errno == EINTR) continue;
    if (more <= 0) break;
    done += static_cast<std::size_t>(more);
  }
  bytes.resize(done);
  return bytes;
}

// The value in an open entry; none where it is not what was put there.
std::optional<std::string> ValueIn(int fd, std::uint64_t bytes, const CacheKey& key) {
  const std::string start = ReadAt(fd, 0, kLongestLine + key.text.size());
  const auto line = start.find('\n');
  if (line == std::string::npos || line >= kLongestLine) return std::nullopt;
  const std::size_t at = line + 1 + key.text.size();
  if (start.compare(line + 1, key.text.size(), key.text) != 0 || bytes < at) return std::nullopt;
  std::string value = ReadAt(fd, at, bytes - at);
  if (start.substr(0, line + 1) != Header(key, value)) return std::nullopt;
  return value;
}

}  // namespace

std::optional<CacheKey> KeyOfThisBuild(const std::string& kind, const std::string& text) {
  const std::string build = BuildId();
  if (build.empty()) return std::nullopt;
  return CacheKey{kind, build + "\n" + text};
}

std::optional<std::string> FindInCache(const CacheKey& key) {
  const fs::path folder = Folder();
  if (!Obstacle(folder).empty()) return std::nullopt;
  const fs::path path = folder / NameOf(key);
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode) ||
      !IsOfThisUserAlone(status))
    return std::nullopt;
  auto value = ValueIn(file.get(), static_cast<std::uint64_t>(status.st_size), key);
  if (value)
    ::futimens(file.get(), nullptr);  // used now
  else
    ::unlink(path.c_str());
  return value;
}

bool PutIntoCache(const CacheKey& key, std::string_view value) {
  const fs::path folder = Folder();
  if (!Obstacle(folder).empty()) return false;
  const std::uint64_t limit = Limit(folder);
  if (value.size() > limit / kLargestShare) return false;
  try {
    MakeFolder(folder, Access::kPrivate);
    SweepTemporaries(folder);
    const std::string header = Header(key, value);
    const std::array<std::string_view, 3> pieces{header, key.text, value};
    // Not synced: its hash tells whether it survived a crash.
    StagedFile(folder / NameOf(key), pieces, Access::kPrivate).Exchange();
  } catch (const Error&) {
    return false;
  }
  Evict(folder, limit);
  return true;
}

CacheUse CacheInUse() {
  CacheUse use;
  use.folder = Folder();
  use.unused = Obstacle(use.folder);
  use.limit_bytes = kDefaultLimit;
  if (!use.unused.empty()) return use;
  use.limit_bytes = Limit(use.folder);
  for (const Entry& entry : Entries(use.folder)) {
    CacheUse::Kind& kind = use.kinds[entry.kind];
    ++kind.entries;
    kind.bytes += entry.bytes;
    use.bytes += entry.bytes;
  }
  return use;
}

namespace {

// The folder, for those who ask for it by name.
fs::path UsedFolder() {
  const fs::path folder = Folder();
  if (const std::string obstacle = Obstacle(folder); !obstacle.empty())
    throw DeviceError(
        fmt::format("the cache{}{} is not used: {}; name a folder of your own by XDG_CACHE_HOME",
                    folder.empty() ? "" : " ", folder.string(), obstacle));
  return folder;
}

}  // namespace

std::uint64_t ClearCache() {
  const fs::path folder = UsedFolder();
  std::uint64_t bytes = 0;
  const auto remove = [&](const fs::path& path, std::uint64_t size) {
    RemoveFile(path);
    bytes += size;
  };
  for (const Entry& entry : Entries(folder)) remove(entry.path, entry.bytes);
  std::error_code error;
  for (auto at = fs::directory_iterator(folder.parent_path(), error); !error && at != fs::end(at);
       at.increment(error))
    if (const auto ending = at->path().extension();
        at->is_regular_file(error) && (ending == ".clbin" || ending == ".json"))
      remove(at->path(), at->file_size(error));
  return bytes;
}

void LimitCache(std::uint64_t bytes) {
  const fs::path folder = UsedFolder();
  MakeFolder(folder, Access::kPrivate);
  const std::string text = std::to_string(bytes);
  const std::string_view piece = text;
  StagedFile(folder / kLimitName, std::span(&piece, 1), Access::kPrivate).PutInPlace();
  Evict(folder, bytes);
}

}  // namespace luxfield::core
