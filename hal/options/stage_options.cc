#include "luxfield/hal/options/stage_options.h"

#include <charconv>
#include <optional>

#include "luxfield/hal/drivers/grbl/grbl_stage.h"
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

grbl::Axis ReadGrblAxis(const core::Config& stage, const char* key, const char* fallback,
                        double origin_m) {
  const std::string name = stage.Choice(key, {"x", "-x", "y", "-y", "z", "-z"}, fallback);
  return {name.back() - 'x', name.front() == '-' ? -1 : 1, 1000 * origin_m};
}

zaber::Axis ReadZaberAxis(const core::Config& stage, const char* key, const char* fallback,
                          double origin_m, double microstep_m) {
  const std::string text = stage.Text(key, fallback);
  const char* at = text.data();
  const char* const end = at + text.size();
  zaber::Axis axis{0, 0, 1, origin_m, microstep_m};
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

}  // namespace

StageOptions ReadStage(const core::Config& stage) {
  StageOptions options;
  const std::string driver = stage.Choice("driver", {"sim", "grbl", "zaber"}, "sim");
  options.limits = ReadLimits(stage);
  if (driver == "sim") return options;
  options.port = stage.Text("port");
  if (options.port.empty()) stage.Fail("port", "is empty", "name a serial port, or tcp:HOST:PORT");
  options.baud = stage.Integer("baud", options.baud, 1, 4000000);
  const auto origin_m = stage.Numbers("origin_m", 2);
  if (driver == "grbl") {
    const grbl::StageSetup setup{options.limits,
                                 {ReadGrblAxis(stage, "u_axis", "x", origin_m[0]),
                                  ReadGrblAxis(stage, "v_axis", "y", origin_m[1])}};
    if (setup.axes[0].machine_axis == setup.axes[1].machine_axis)
      stage.Fail("v_axis", "is the axis of u", "name another");
    options.setup = setup;
  } else {
    const auto microstep_m = stage.Numbers("microstep_m", 2);
    const zaber::StageSetup setup{
        options.limits,
        {ReadZaberAxis(stage, "u_axis", "1.1", origin_m[0], microstep_m[0]),
         ReadZaberAxis(stage, "v_axis", "2.1", origin_m[1], microstep_m[1])}};
    if (setup.axes[0].device == setup.axes[1].device &&
        setup.axes[0].number == setup.axes[1].number)
      stage.Fail("v_axis", "is the axis of u", "name another");
    options.setup = setup;
  }
  return options;
}

void Tighten(StageOptions& stage, const StageBounds& plan) {
  stage.limits = Tightened(stage.limits, plan);
  if (auto* setup = std::get_if<grbl::StageSetup>(&stage.setup)) setup->limits = stage.limits;
  if (auto* setup = std::get_if<zaber::StageSetup>(&stage.setup)) setup->limits = stage.limits;
}

std::unique_ptr<Stage> OpenStage(const StageOptions& options, std::shared_ptr<core::Clock> clock) {
  auto port = OpenPort(options.port, options.baud, SecondsFromNow(kOpen_s));
  if (const auto* setup = std::get_if<grbl::StageSetup>(&options.setup))
    return std::make_unique<grbl::GrblStage>(std::move(port), *setup, std::move(clock));
  return std::make_unique<zaber::ZaberStage>(
      std::move(port), std::get<zaber::StageSetup>(options.setup), std::move(clock));
}

}  // namespace luxfield::hal
