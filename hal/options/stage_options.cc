#include "luxfield/hal/options/stage_options.h"

#include <vector>

#include "luxfield/hal/drivers/list/drivers.h"
#include "luxfield/hal/transport/open_port.h"

namespace luxfield::hal {
namespace {

constexpr double kOpen_s = 5;

StageLimits ReadLimits(const core::Config& stage) {
  StageLimits limits;
  const auto low = stage.Numbers("min_m", 2), high = stage.Numbers("max_m", 2);
  limits.min = {low[0], low[1]};
  limits.max = {high[0], high[1]};
  if (low[0] >= high[0] || low[1] >= high[1])
    stage.Fail("max_m", "must lie above min_m in both axes");
  limits.speed_m_per_s = stage.Number("speed_m_per_s", 0.02, {1e-6, 100});
  limits.settle_s = stage.Number("settle_s", 0.5, {0, 100});
  return limits;
}

std::vector<std::string> StageDrivers() {
  std::vector<std::string> names = {"sim"};
  for (const Driver& driver : AllDrivers())
    if (driver.read_stage) names.push_back(driver.name);
  return names;
}

}  // namespace

StageOptions ReadStage(const core::Config& stage) {
  StageOptions options;
  const std::string driver = stage.Choice("driver", StageDrivers(), "sim");
  options.limits = ReadLimits(stage);
  if (driver == "sim") return options;
  options.port = stage.Text("port");
  if (options.port.empty()) stage.Fail("port", "is empty", "name a serial port, or tcp:HOST:PORT");
  options.baud = stage.Integer("baud", options.baud, 1, 4000000);
  options.open = DriverNamed(driver).read_stage(stage);
  return options;
}

void Tighten(StageOptions& stage, const StageBounds& plan) {
  stage.limits = Tightened(stage.limits, plan);
}

std::unique_ptr<Stage> OpenStage(const StageOptions& options, std::shared_ptr<core::Clock> clock) {
  return options.open(OpenPort(options.port, options.baud, SecondsFromNow(kOpen_s)), options.limits,
                      std::move(clock));
}

}  // namespace luxfield::hal
