// What `luxfield --version` says.
#pragma once

#include <string>

namespace luxfield::cli {

// The version on the first line; then the commit that was built, the build's type and compiler, its
// optional parts and the versions of libraries that it was built with.
std::string BuildFacts();

}  // namespace luxfield::cli
