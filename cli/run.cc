#include "luxfield/cli/run.h"

namespace luxfield::cli {
namespace {

void AddAll(Program& program, const std::vector<AddVerbs>& more) {
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
  AddPhotometry(program);
  AddShard(program);
  AddInfo(program);
  AddCompare(program);
  AddCache(program);
  for (const AddVerbs add : more) add(program);
  AddDemo(program);
}

}  // namespace

int Run(int argc, char** argv, const std::vector<AddVerbs>& more) {
  return RunProgram(argc, argv, [&](Program& program) { AddAll(program, more); });
}

}  // namespace luxfield::cli
