// Parts of a file's struct that whoever reads it needs.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>

#include "luxfield/core/error.h"

namespace luxfield::session {

// What `key` of the file states. Throws InputError naming file and key where it is absent.
template <typename T>
const T& Stated(const std::optional<T>& part, const char* key, const std::string& file) {
  if (!part)
    throw InputError(file, fmt::format("field '{}' is missing", key),
                     "restore the file from its writer");
  return *part;
}

}  // namespace luxfield::session
