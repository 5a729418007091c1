#include <csignal>
#include <cstdio>
#include <new>

#include "luxfield/cli/run.h"
#include "luxfield/cli/standard_streams.h"

namespace luxfield::cli {

int RunProgram(int argc, char** argv, const std::function<void(Program&)>& add_verbs) {
  // A file that outgrows the process's limit is an error of the write (EFBIG), with a sentence.
  std::signal(SIGXFSZ, SIG_IGN);
  OpenClosedStandardStreams();
  ShowWhatTerminalsObey();
  try {
    Program program;
    add_verbs(program);
    return program.Run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("luxfield: no memory to begin with; raise the limit (`ulimit -v`)\n", stderr);
    return 3;
  }
}

}  // namespace luxfield::cli
