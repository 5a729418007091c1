// What calls of the library say (core/execution.h), for tests.
#pragma once

#include <functional>
#include <string>

#include "luxfield/core/execution.h"

namespace luxfield {

// Every message of `work` and a line end after each.
inline std::string Said(const std::function<void()>& work) {
  std::string said;
  core::RunWith({.message = [&](core::Severity, const std::string& m) { said += m + "\n"; }}, work);
  return said;
}

}  // namespace luxfield
