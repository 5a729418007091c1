// luxfield plan PLAN --lab LAB: what a capture would do, without a device moving.
#include <fmt/format.h>

#include <memory>

#include "capture/capture.h"
#include "cli/capture_report.h"
#include "cli/program.h"
#include "hal/devices.h"

namespace luxfield::cli {
namespace {

struct Options {
  std::string plan, lab;
};

core::Json Run(const Options& options) {
  const core::Config config = core::Config::FromFile(options.plan);
  const hal::Devices devices = hal::MakeDevices(options.lab);
  if (capture::ReadPlanKind(config) == capture::PlanKind::kSensor)
    return PrintDryRun(capture::ExpandPlan(capture::ReadSensorPlan(config), devices), devices);
  if (capture::ReadPlanKind(config) == capture::PlanKind::kGeometry)
    return PrintDryRun(capture::ExpandPlan(capture::ReadGeometryPlan(config), devices), devices);
  if (capture::ReadPlanKind(config) == capture::PlanKind::kGlare)
    return PrintDryRun(capture::ExpandPlan(capture::ReadGlarePlan(config), devices), devices);
  return PrintDryRun(capture::ExpandPlan(capture::ReadPlan(config), devices), devices);
}

}  // namespace

void AddPlan(Program& program) {
  auto options = std::make_shared<Options>();
  CLI::App& verb =
      program.AddVerb("plan", "Expand a plan against a lab: positions, exposures, time, bytes",
                      [options] { return Run(*options); });
  verb.add_option("PLAN", options->plan, "The plan.toml")->required();
  verb.add_option("--lab", options->lab, "The lab.toml it is for")->required();
}

}  // namespace luxfield::cli
