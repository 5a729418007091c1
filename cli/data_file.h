// The labs, plans and scenes that come with the program.
#pragma once

#include <string>

namespace luxfield::cli {

// data/NAME where the program is run in the source tree, else the installed one
// (PREFIX/share/luxfield/data); where there is neither, the first, for the message that it is missing.
std::string DataFile(const std::string& name);

}  // namespace luxfield::cli
