// Computed values from the cache, or computed and kept (core/cache.h).
#pragma once

#include <optional>

#include "luxfield/core/bytes.h"
#include "luxfield/core/cache.h"

namespace luxfield::core {

// The value under the key; where there is none, or no key, build(), which is kept if worth(value).
// transfer(pass, value) hands all parts of the value that depend on what was built to pass(parts...),
// a ByteReader or a ByteWriter; `start` has the other parts.
//
//   Kept(KeyOfThisBuild("table", sha256), [](auto& pass, auto& table) { pass(table.data); },
//        Table(), [&] { return BuildTable(field); });
template <typename Value, typename Transfer, typename Build, typename Worth>
Value Kept(const std::optional<CacheKey>& key, const Transfer& transfer, const Value& start,
           const Build& build, const Worth& worth) {
  if (!key) return build();
  if (const auto bytes = FindInCache(*key)) {
    ByteReader reader(*bytes);
    Value value = start;
    transfer(reader, value);
    if (reader.whole()) return value;
  }
  Value value = build();
  if (worth(value)) {
    ByteWriter writer;
    transfer(writer, value);
    PutIntoCache(*key, writer.bytes());
  }
  return value;
}

template <typename Value, typename Transfer, typename Build>
Value Kept(const std::optional<CacheKey>& key, const Transfer& transfer, const Value& start,
           const Build& build) {
  return Kept(key, transfer, start, build, [](const Value&) { return true; });
}

}  // namespace luxfield::core
