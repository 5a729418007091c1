#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "luxfield/cli/run.h"
#include "luxfield/cli/standard_streams.h"

namespace luxfield::cli {

namespace {

std::atomic<bool> runs = false;

// `exit` while a verb runs is a library's: the compilers of kernels end a program whose disk is full,
// Xlib one whose X server is gone.
void TellOfAnEndByALibrary() {
  if (!runs) return;
  std::fputs(
      "luxfield: a library ended the program after its message above; if the display went away, "
      "start it again where one is; else free disk space, or raise the limits of memory and of "
      "file sizes (`ulimit -a` lists them)\n",
      stderr);
  std::fflush(stderr);
  ::_exit(3);
}

struct Running {
  Running() { runs = true; }
  ~Running() { runs = false; }
};

}  // namespace

int RunProgram(int argc, char** argv, const std::function<void(Program&)>& add_verbs) {
  // A file that outgrows the process's limit is an error of the write (EFBIG), with a sentence.
  std::signal(SIGXFSZ, SIG_IGN);
  OpenClosedStandardStreams();
  ShowWhatTerminalsObey();
  static const int registered = std::atexit(TellOfAnEndByALibrary);
  (void)registered;
  const Running running;
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
