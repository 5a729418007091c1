// The [stage] of a lab.toml (docs/formats/lab-and-plan.md), and the driver it names.
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/drivers/grbl/machine.h"
#include "luxfield/hal/drivers/zaber/zaber_stage.h"
#include "luxfield/hal/safety/stage_bounds.h"

namespace luxfield::hal {

struct StageOptions {
  StageLimits limits;
  std::string port;  // of a real stage; empty where it is simulated
  int baud = 115200;
  std::variant<std::monostate, grbl::StageSetup, zaber::StageSetup> setup;
};

// Throws InputError naming file and field.
StageOptions ReadStage(const core::Config& stage);

// Puts the tighter of both limits in place of the lab's. Throws as Tightened.
void Tighten(StageOptions& stage, const StageBounds& plan);

// The real stage; `clock` is that of the deadlines. HardwareError where it does not answer or is
// not the stage described. `options.port` must not be empty.
std::unique_ptr<Stage> OpenStage(const StageOptions& options, std::shared_ptr<core::Clock> clock);

}  // namespace luxfield::hal
