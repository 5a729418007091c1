// The program that starts at once: it answers what needs none of the libraries of devices, pictures
// and solvers, and hands the rest over to the program of all verbs, `luxfield-verbs`, or to that of a
// room above this one; these lie beside it or, installed, in libexec/luxfield/.
#pragma once

#include <string_view>
#include <vector>

#include "luxfield/cli/verb_list.h"

namespace luxfield::cli {

// A verb of a room above this one, and the name of the program that does it.
struct VerbElsewhere {
  VerbName verb;
  std::string_view program;
};

// What main() does: `--help`, `--version`, `info` of files other than .toml, and words that are no
// verb; everything else is handed over. `more` are listed before the last verb.
int RunQuick(int argc, char** argv, const std::vector<VerbElsewhere>& more = {});

}  // namespace luxfield::cli
