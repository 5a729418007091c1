// The whole program, from its first line to its exit code.
#pragma once

namespace luxfield::cli {

// What main() does: its standard streams, every verb, and the one that the command line names.
int Run(int argc, char** argv);

}  // namespace luxfield::cli
