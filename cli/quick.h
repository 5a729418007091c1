// The program that starts at once: it answers what needs none of the libraries of devices, pictures
// and solvers, and hands the rest over to the program of all verbs, `luxfield-verbs`, which lies
// beside it or, installed, in libexec/luxfield/.
#pragma once

#include <vector>

#include "luxfield/cli/verb_list.h"

namespace luxfield::cli {

// What main() does: `--help`, `--version`, `info` of files other than .toml, and words that are no
// verb; everything else is handed over. `more` are verbs of rooms above this one, listed before
// the last.
int RunQuick(int argc, char** argv, const std::vector<VerbName>& more = {});

}  // namespace luxfield::cli
