// The verbs as `luxfield --help` lists them.
#pragma once

#include <span>
#include <string_view>

namespace luxfield::cli {

struct VerbName {
  std::string_view name, description;
};

// In the order of the list, without those of rooms above this one.
std::span<const VerbName> Verbs();

// The one of that name, which is one of them.
const VerbName& VerbNamed(std::string_view name);

}  // namespace luxfield::cli
