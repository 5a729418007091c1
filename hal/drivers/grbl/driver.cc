#include "luxfield/hal/drivers/grbl/driver.h"

#include "luxfield/hal/drivers/grbl/grbl_stage.h"

namespace luxfield::hal::grbl {
namespace {

Axis ReadAxis(const core::Config& stage, const char* key, const char* fallback, double origin_m) {
  const std::string name = stage.Choice(key, {"x", "-x", "y", "-y", "z", "-z"}, fallback);
  return {name.back() - 'x', name.front() == '-' ? -1 : 1, 1000 * origin_m};
}

OpenStageOn Read(const core::Config& stage) {
  const auto origin_m = stage.Numbers("origin_m", 2);
  const std::array axes = {ReadAxis(stage, "u_axis", "x", origin_m[0]),
                           ReadAxis(stage, "v_axis", "y", origin_m[1])};
  if (axes[0].machine_axis == axes[1].machine_axis)
    stage.Fail("v_axis", "is the axis of u", "name another");
  return [axes](std::unique_ptr<ByteStream> port, const StageLimits& limits,
                std::shared_ptr<core::Clock> clock) {
    return std::make_unique<GrblStage>(std::move(port), StageSetup{limits, axes}, std::move(clock));
  };
}

}  // namespace

Driver Description() {
  return {
      "grbl", "stage: Grbl 1.1, grblHAL or FluidNC over a serial port or TCP", true, "", {}, Read,
      {}};
}

}  // namespace luxfield::hal::grbl
