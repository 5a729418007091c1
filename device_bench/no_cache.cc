// core/cache.h without a folder, and so without the library that hashes: nothing is kept.
#include "luxfield/core/cache.h"

namespace luxfield::core {

std::optional<std::string> FindInCache(const CacheKey&) { return std::nullopt; }
bool PutIntoCache(const CacheKey&, std::string_view) { return false; }

}  // namespace luxfield::core
