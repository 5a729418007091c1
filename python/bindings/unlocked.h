// Calls of the library without the interpreter's lock.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "luxfield/core/execution.h"

namespace luxfield::python {

// What work() returns. What the library warns of becomes Python's LuxfieldWarning, at the line that
// called the function `levels` above this one.
template <typename Work>
std::invoke_result_t<Work> Unlocked(int levels, Work&& work) {
  std::vector<std::string> warnings;
  std::optional<std::invoke_result_t<Work>> result;
  {
    const pybind11::gil_scoped_release unlocked;
    core::RunWith({.message = [&](core::Severity, const std::string& m) { warnings.push_back(m); }},
                  [&] { result.emplace(work()); });
  }
  if (!warnings.empty()) {
    const pybind11::object category =
        pybind11::module_::import("luxfield.errors").attr("LuxfieldWarning");
    for (const std::string& warning : warnings)
      if (PyErr_WarnEx(category.ptr(), warning.c_str(), levels) != 0)
        throw pybind11::error_already_set();
  }
  return std::move(*result);
}

}  // namespace luxfield::python
