#include "cli/run.h"

#include "cli/program.h"
#include "cli/standard_streams.h"

namespace luxfield::cli {

int Run(int argc, char** argv) {
  OpenClosedStandardStreams();
  ShowWhatTerminalsObey();
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
  AddPreprocess(program);
  AddRender(program);
  AddInfo(program);
  AddCompare(program);
  AddBench(program);
  AddDemo(program);
  return program.Run(argc, argv);
}

}  // namespace luxfield::cli
