// Files that come with the program: labs, plans and scenes, judges of other programs.
#pragma once

#include <filesystem>
#include <string>

namespace luxfield::cli {

// NAME, as "data/labs/headlight.toml", in the working folder where it is the source tree, else the
// installed one (PREFIX/share/luxfield/NAME), else that of the source tree that the program was built
// in, PROGRAM/../../NAME; where there is none, the first, for the message that it is missing.
std::filesystem::path SharedFile(const std::string& name);

}  // namespace luxfield::cli
