// What can be made again, kept between runs: compiled kernels, tables, volumes, cube maps
// (docs/cache.md).
//
// One folder, $XDG_CACHE_HOME/luxfield/store (else ~/.cache/luxfield/store), of this user alone. An
// entry is a file
//
//   name   <SHA-256 of kind and key>.<kind>
//   line   "luxfield cache 1 <bytes of key> <bytes of value> <SHA-256 of value>\n"
//   key    everything that decides the value, in full: an entry of another key is not used
//   value
//
// and its time of change is that of its last use. An entry that is damaged, of another user or none
// of ours is as good as absent. The folder is bounded: what is put there makes the entries go that
// were not used for longest. Any number of processes use it at once. A folder that is absent, full,
// of another user or open to other users costs the making of its values, nothing else.
//
// The environment variable LUXFIELD_CACHE=off does without.
//
//   const core::CacheKey key{"volume", "all that decides it"};
//   if (const auto value = core::FindInCache(key)) return Unpack(*value);
//   core::PutIntoCache(key, Pack(made));
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace luxfield::core {

struct CacheKey {
  std::string kind;  // lower-case letters and '-': what `luxfield cache` lists values by
  std::string text;  // everything that decides the value
};

// A key of what this program computes: it holds for this build alone (core/build_id.h). None where
// builds cannot be told apart.
std::optional<CacheKey> KeyOfThisBuild(const std::string& kind, const std::string& text);

// The value, and that it was used.
std::optional<std::string> FindInCache(const CacheKey& key);

// Whether it is kept. Values of more than a quarter of the folder's limit are not.
bool PutIntoCache(const CacheKey& key, std::string_view value);

struct CacheUse {
  std::filesystem::path folder;  // empty: there is none
  std::string unused;            // why the folder is not used; empty: it is
  struct Kind {
    std::uint64_t entries = 0, bytes = 0;
  };
  std::map<std::string, Kind> kinds;
  std::uint64_t bytes = 0, limit_bytes = 0;
};
CacheUse CacheInUse();

// Removes all entries, and what earlier versions kept beside the folder. Returns the bytes that were
// freed. Throws DeviceError where the folder is not used, or keeps them.
std::uint64_t ClearCache();

// Bytes that the folder may hold from now on, 1 GiB before it is first set; evicts what is beyond.
// Throws DeviceError where it cannot be kept.
void LimitCache(std::uint64_t bytes);

}  // namespace luxfield::core
