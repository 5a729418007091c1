// Fields of a JSON object that may be absent.
#pragma once

#include <optional>
#include <string>

#include "luxfield/core/json.h"

namespace luxfield::session {

// Nothing is written for an empty value.
template <typename T>
void Set(core::Json& json, const char* key, const std::optional<T>& value) {
  if (value) json[key] = *value;
}

// Empty where the key is absent; throws InputError naming file and key for another type.
template <typename T>
std::optional<T> Get(const core::Json& json, const char* key, const std::string& file) {
  if (!json.contains(key)) return std::nullopt;
  return core::Field<T>(json, key, file);
}

}  // namespace luxfield::session
