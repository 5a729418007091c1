// The [stage] of a lab.toml (docs/formats/lab-and-plan.md), and the driver it names.
#pragma once

#include <memory>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/drivers/driver.h"
#include "luxfield/hal/safety/stage_bounds.h"

namespace luxfield::hal {

struct StageOptions {
  StageLimits limits;
  std::string port;  // of a real stage; empty where it is simulated
  int baud = 115200;
  OpenStageOn open;  // of a real stage
};

// Throws InputError naming file and field.
StageOptions ReadStage(const core::Config& stage);

// Puts the tighter of both limits in place of the lab's. Throws as Tightened.
void Tighten(StageOptions& stage, const StageBounds& plan);

// The real stage; `clock` is that of the deadlines. HardwareError where it does not answer or is
// not the stage described. `options.port` must not be empty.
std::unique_ptr<Stage> OpenStage(const StageOptions& options, std::shared_ptr<core::Clock> clock);

}  // namespace luxfield::hal
