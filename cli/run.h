// The whole program, from its first line to its exit code.
#pragma once

#include <vector>

#include "luxfield/cli/program.h"

namespace luxfield::cli {

// Adds verbs of rooms above this one.
using AddVerbs = void (*)(Program& program);

// What main() does: its standard streams, every verb, `more` among them, and the one that the
// command line names.
int Run(int argc, char** argv, const std::vector<AddVerbs>& more = {});

}  // namespace luxfield::cli
