#include "luxfield/cli/run.h"

#include <csignal>
#include <cstdio>
#include <new>

#include "luxfield/cli/standard_streams.h"

namespace luxfield::cli {
namespace {

int RunVerb(int argc, char** argv, const std::vector<AddVerbs>& more) {
  Program program;
  AddDevices(program);
  AddSimulate(program);
  AddSky(program);
  AddPlan(program);
  AddCapture(program);
  AddVerify(program);
  AddReport(program);
  AddCalibrate(program);
  AddFilter(program);
  AddProbe(program);
  AddMerge(program);
  AddReconstruct(program);
  AddBudget(program);
  AddImport(program);
  AddExport(program);
  AddPreprocess(program);
  AddRender(program);
  AddRelight(program);
  AddInfo(program);
  AddCompare(program);
  for (const AddVerbs add : more) add(program);
  AddDemo(program);
  return program.Run(argc, argv);
}

}  // namespace

int Run(int argc, char** argv, const std::vector<AddVerbs>& more) {
  // A file that outgrows the process's limit is an error of the write (EFBIG), with a sentence.
  std::signal(SIGXFSZ, SIG_IGN);
  OpenClosedStandardStreams();
  ShowWhatTerminalsObey();
  try {
    return RunVerb(argc, argv, more);
  } catch (const std::bad_alloc&) {
    std::fputs("luxfield: no memory to begin with; raise the limit (`ulimit -v`)\n", stderr);
    return 3;
  }
}

}  // namespace luxfield::cli
