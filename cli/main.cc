#include "cli/program.h"
#include "cli/standard_streams.h"

int main(int argc, char** argv) {
  luxfield::cli::OpenClosedStandardStreams();
  luxfield::cli::Program program;
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
