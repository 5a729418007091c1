// Why something cannot be shown.
#pragma once

#include <exception>
#include <string>

namespace luxfield::view {

struct Failure {
  std::string sentence;
  int exit_code = 2;  // that the program ends in (core/error.h)
};

// Of an exception that is being handled.
Failure CurrentFailure();

}  // namespace luxfield::view
