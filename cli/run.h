// The whole program, from its first line to its exit code.
#pragma once

#include <functional>
#include <vector>

#include "luxfield/cli/program.h"

namespace luxfield::cli {

// Adds verbs of rooms above this one.
using AddVerbs = void (*)(Program& program);

// Standard streams, the verbs that `add_verbs` adds, and the one that the command line names.
int RunProgram(int argc, char** argv, const std::function<void(Program&)>& add_verbs);

// The same with every verb, `more` among them.
int Run(int argc, char** argv, const std::vector<AddVerbs>& more = {});

}  // namespace luxfield::cli
