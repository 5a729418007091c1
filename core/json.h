// JSON files that name file and field when something is wrong.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/range.h"

namespace luxfield::core {

using Json = nlohmann::json;  // keys sorted: equal content gives equal bytes

constexpr int kDeepestJson = 100;

// Values lie within that many others at most: copies and texts of one that is nested deeper, which
// none of ours is, take a stack frame each.
inline Json ParseJson(std::string_view text, const std::string& file) {
  const auto shallow = [&file](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepestJson)
      throw InputError(file, fmt::format("values are nested more than {} deep", kDeepestJson),
                       "restore it from its writer");
    return true;
  };
  try {
    return Json::parse(text, shallow);
  } catch (const Json::exception& error) {
    throw InputError(file, fmt::format("not valid JSON ({})", error.what()),
                     "restore it from its writer");
  }
}

inline Json ReadJson(const std::filesystem::path& path) {
  return ParseJson(ReadFile(path), path.string());
}

inline void WriteJson(const std::filesystem::path& path, const Json& json) {
  // Text of other people's files may be no UTF-8, which JSON has to be: U+FFFD stands for it.
  constexpr auto kReplace = Json::error_handler_t::replace;
  WriteFileAtomically(path, json.dump(2, ' ', false, kReplace) + "\n");
}

// Whether T can hold what the value says: converting a number that a whole T cannot hold gives
// another one, or is undefined; any other number must be finite and at most kLargestNumber.
template <typename T>
struct CanHold {
  static bool Check(const Json& value) {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      if (value.is_number_unsigned()) return std::in_range<T>(value.get<std::uint64_t>());
      if (value.is_number_integer()) return std::in_range<T>(value.get<std::int64_t>());
      if (!value.is_number_float()) return false;
      constexpr double kExact = 9007199254740992.0;  // 2^53
      const double number = value.get<double>();
      return number >= -kExact && number <= kExact && number == std::trunc(number) &&
             std::in_range<T>(static_cast<std::int64_t>(number));
    }
    if constexpr (std::is_floating_point_v<T>)
      return value.is_number() && Range{}.Holds(value.get<double>());
    return true;
  }
};
template <typename T>
struct CanHold<std::vector<T>> {
  static bool Check(const Json& value) {
    return value.is_array() && std::all_of(value.begin(), value.end(), CanHold<T>::Check);
  }
};
template <typename A, typename B>
struct CanHold<std::pair<A, B>> {
  static bool Check(const Json& value) {
    return value.is_array() && value.size() == 2 && CanHold<A>::Check(value[0]) &&
           CanHold<B>::Check(value[1]);
  }
};

// json[key] as T; InputError naming file and key if absent, of another type, or a number that T
// cannot hold.
template <typename T>
T Field(const Json& json, const std::string& key, const std::string& file) {
  if (!json.is_object() || !json.contains(key))
    throw InputError(file, fmt::format("field '{}' is missing", key),
                     "restore the file from its writer");
  try {
    if (CanHold<T>::Check(json.at(key))) return json.at(key).get<T>();
  } catch (const Json::exception&) {
  }
  throw InputError(file,
                   fmt::format("field '{}' = {} has the wrong type, or is a number beyond all that "
                               "is measured",
                               key, json.at(key).dump()),
                   "restore the file from its writer");
}

// json[key], which must be in the range; `remedy` says what to do about one that is not.
inline double NumberField(const Json& json, const std::string& key, const std::string& file,
                          Range range,
                          const std::string& remedy = "restore the file from its writer") {
  const double value = Field<double>(json, key, file);
  if (!range.Holds(value))
    throw InputError(file,
                     fmt::format("{} = {:g} makes no sense; it lies between {:g} and {:g}", key,
                                 value, range.min, range.max),
                     remedy);
  return value;
}

// The same of a field that may be absent: then `fallback`.
template <typename T>
T FieldOr(const Json& json, const std::string& key, const T& fallback, const std::string& file) {
  return json.is_object() && !json.contains(key) ? fallback : Field<T>(json, key, file);
}

}  // namespace luxfield::core
