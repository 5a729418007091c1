// luxfield info FILE.
#pragma once

#include <functional>
#include <string>

#include "luxfield/cli/program.h"

namespace luxfield::cli {

// What is said of a .toml: a plan, a lab or a scene, which take libraries to read that other files
// do without.
using InfoOfToml = std::function<core::Json(const std::string& path)>;

core::Json InfoToml(const std::string& path);

void AddInfo(Program& program, InfoOfToml info_of_toml);

}  // namespace luxfield::cli
