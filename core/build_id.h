// Which build of the program this is.
#pragma once

#include <string>

namespace luxfield::core {

// The linker's identities (.note.gnu.build-id, hexadecimal) of the program and of our shared
// libraries that it has loaded: equal exactly where their bytes are. Empty if one of them has none.
std::string BuildId();

}  // namespace luxfield::core
