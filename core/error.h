// What can go wrong, and the exit code it ends in (docs/verbs.md, "Exit codes").
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace luxfield {

// Base of every exception luxfield throws on purpose. what() is one sentence for the person at the
// terminal: what failed, with which value, and what to do about it.
class Error : public std::runtime_error {
 public:
  Error(const std::string& message, int exit_code)
      : std::runtime_error(message), exit_code_(exit_code) {}
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};

// The input or the arguments are wrong: exit 2.
class InputError : public Error {
 public:
  explicit InputError(const std::string& message) : Error(message, 2) {}
  // "FILE: PROBLEM; REMEDY" (remedy may be empty).
  InputError(std::string_view file, std::string_view problem, std::string_view remedy = {});
};

// Hardware, storage or a compute device failed: exit 3.
class DeviceError : public Error {
 public:
  explicit DeviceError(const std::string& message) : Error(message, 3) {}
};

// Stopped on request, resumable: exit 4.
class Interrupted : public Error {
 public:
  explicit Interrupted(const std::string& message) : Error(message, 4) {}
};

}  // namespace luxfield
