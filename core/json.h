// JSON files that name file and field when something is wrong.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "core/error.h"
#include "core/file.h"

namespace luxfield::core {

using Json = nlohmann::json;  // keys sorted: equal content gives equal bytes

inline Json ParseJson(std::string_view text, const std::string& file) {
  try {
    return Json::parse(text);
  } catch (const Json::exception& error) {
    throw InputError(file, fmt::format("not valid JSON ({})", error.what()),
                     "restore it from its writer");
  }
}

inline Json ReadJson(const std::filesystem::path& path) {
  return ParseJson(ReadFile(path), path.string());
}

inline void WriteJson(const std::filesystem::path& path, const Json& json) {
  WriteFileAtomically(path, json.dump(2) + "\n");
}

// json[key] as T; InputError naming file and key if absent or of another type.
template <typename T>
T Field(const Json& json, const std::string& key, const std::string& file) {
  if (!json.is_object() || !json.contains(key))
    throw InputError(file, fmt::format("field '{}' is missing", key),
                     "restore the file from its writer");
  try {
    return json.at(key).get<T>();
  } catch (const Json::exception&) {
    throw InputError(file,
                     fmt::format("field '{}' = {} has the wrong type", key, json.at(key).dump()),
                     "restore the file from its writer");
  }
}

}  // namespace luxfield::core
