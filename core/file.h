// Files that exist whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace luxfield::core {

// The whole file as bytes. Throws InputError (missing, a folder, unreadable) naming the path.
std::string ReadFile(const std::filesystem::path& path);

// The same, handed to `take` at most 1 MiB at a time.
void ReadInPieces(const std::filesystem::path& path,
                  const std::function<void(std::string_view piece)>& take);

// Writes `bytes` so that `path` holds either its old content or all of the new one, also after a
// crash: temporary file in the same folder, fsync, rename, fsync of the folder. Throws DeviceError
// (disk full, read-only ...), InputError where a folder, pipe or device has the name. The temporary
// file is removed, and where the folder cannot be synced so is a file that is new.
enum class Access { kUmask, kPrivate };  // private: the owner's alone (0600, folders 0700)
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes,
                         Access access = Access::kUmask);

// The same for writers that need a path of their own (OpenEXR, TIFF, PNG): `write` is called with
// a temporary path beside `path` and with the same extension; when it returns the file is made
// durable and renamed. When it throws, the temporary file is removed and the exception passed on.
void WriteAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

// Makes a folder, and those above it that are missing, so that they outlive a crash; nothing where
// it exists. Those above it are as the umask has them. Throws DeviceError.
void MakeFolder(const std::filesystem::path& folder, Access access = Access::kUmask);

// Removes a file, or a link and not what it leads to; nothing where there is none. Throws
// DeviceError. Not durable before the folder is synced.
void RemoveFile(const std::filesystem::path& path);

// Makes a rename in `folder` durable.
void SyncFolder(const std::filesystem::path& folder);

// Called after each step of a write ("temporary written", "temporary synced", "renamed", "folder
// synced", "line written", "line synced"): tests kill the process there. Empty by default.
void SetStorageHookForTest(std::function<void(std::string_view step)> hook);
void StorageStep(std::string_view step);  // for writers of durable files: calls the hook

// A file for what can be made again: $XDG_CACHE_HOME/luxfield/NAME, else ~/.cache/luxfield/NAME.
// Empty if neither variable is set.
std::filesystem::path CacheFile(const std::string& name);

// Lower-case hexadecimal SHA-256 of bytes, or of a file streamed in 1 MiB pieces.
std::string Sha256(std::string_view bytes);
std::string Sha256OfFile(const std::filesystem::path& path);

// CRC-32C (Castagnoli, polynomial 0x1EDC6F41 reflected; RFC 3720 B.4), as session journals use it.
std::uint32_t Crc32c(std::string_view bytes);

}  // namespace luxfield::core
