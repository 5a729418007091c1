#include "luxfield/hal/drivers/zaber/driver.h"

#include <charconv>

#include "luxfield/hal/drivers/zaber/zaber_stage.h"

namespace luxfield::hal::zaber {
namespace {

Axis ReadAxis(const core::Config& stage, const char* key, const char* fallback, double origin_m,
              double microstep_m) {
  const std::string text = stage.Text(key, fallback);
  const char* at = text.data();
  const char* const end = at + text.size();
  Axis axis{0, 0, 1, origin_m, microstep_m};
  if (at != end && *at == '-') {
    axis.sign = -1;
    ++at;
  }
  const auto device = std::from_chars(at, end, axis.device);
  bool good = device.ec == std::errc() && device.ptr != end && *device.ptr == '.';
  if (good) {
    const auto number = std::from_chars(device.ptr + 1, end, axis.number);
    good = number.ec == std::errc() && number.ptr == end;
  }
  if (!good || axis.device < 1 || axis.device > 99 || axis.number < 1 || axis.number > 9)
    stage.Fail(key, "is \"" + text + "\", which names no axis",
               "write device and axis number, such as \"1.1\" or \"-2.1\"");
  if (!(microstep_m > 0)) stage.Fail("microstep_m", "must be above 0");
  return axis;
}

OpenStageOn Read(const core::Config& stage) {
  const auto origin_m = stage.Numbers("origin_m", 2), microstep_m = stage.Numbers("microstep_m", 2);
  const std::array axes = {ReadAxis(stage, "u_axis", "1.1", origin_m[0], microstep_m[0]),
                           ReadAxis(stage, "v_axis", "2.1", origin_m[1], microstep_m[1])};
  if (axes[0].device == axes[1].device && axes[0].number == axes[1].number)
    stage.Fail("v_axis", "is the axis of u", "name another");
  return [axes](std::unique_ptr<ByteStream> port, const StageLimits& limits,
                std::shared_ptr<core::Clock> clock) {
    return std::make_unique<ZaberStage>(std::move(port), StageSetup{limits, axes},
                                        std::move(clock));
  };
}

}  // namespace

Driver Description() {
  return {"zaber", "stage: two Zaber axes, ASCII protocol, over a serial port or TCP",
          true,    "",
          {},      Read,
          {}};
}

}  // namespace luxfield::hal::zaber
