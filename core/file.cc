#include "luxfield/core/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/error.h"
#include "luxfield/core/outputs.h"

namespace luxfield::core {
namespace {

constexpr std::array<std::uint32_t, 256> MakeCrc32cTable() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) ? 0x82F63B78u : 0u);
    table[byte] = crc;
  }
  return table;
}

std::function<void(std::string_view)> g_storage_hook;

}  // namespace

void SetStorageHookForTest(std::function<void(std::string_view)> hook) {
  g_storage_hook = std::move(hook);
}

void StorageStep(std::string_view step) {
  if (g_storage_hook) g_storage_hook(step);
}

void SyncFolder(const std::filesystem::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0 || ::fsync(directory.get()) != 0) FailWriting(folder, "sync folder");
}

void MakeFolder(const std::filesystem::path& folder, Access access) {
  if (std::filesystem::is_directory(folder)) return;
  const auto named = folder.has_filename() ? folder : folder.parent_path();  // "session/"
  const auto above = FolderOf(named);
  MakeFolder(above);
  if (::mkdir(named.c_str(), access == Access::kPrivate ? 0700 : 0777) != 0) {
    if (errno == EEXIST && std::filesystem::is_directory(named)) return;  // by another, meanwhile
    FailWriting(named, "create the folder");
  }
  SyncFolder(above);
}

void RemoveFile(const std::filesystem::path& path) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) FailWriting(path, "remove");
}

void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path&)>& write) {
  Place(StagedFile(path, write));
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes, Access access) {
  Place(StagedFile(path, std::span(&bytes, 1), access));
}

std::filesystem::path CacheFile(const std::string& name) {
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg && *xdg) return std::filesystem::path(xdg) / "luxfield" / name;
  const char* home = std::getenv("HOME");
  if (home && *home) return std::filesystem::path(home) / ".cache" / "luxfield" / name;
  return {};
}

std::uint32_t Crc32c(std::string_view bytes) {
  static constexpr auto kTable = MakeCrc32cTable();
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char byte : bytes)
    crc = (crc >> 8) ^ kTable[(crc ^ static_cast<unsigned char>(byte)) & 0xFFu];
  return ~crc;
}

}  // namespace luxfield::core
