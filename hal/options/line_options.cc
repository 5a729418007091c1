#include "luxfield/hal/options/line_options.h"

#include <algorithm>
#include <array>
#include <optional>

#include "luxfield/hal/built_drivers.h"

namespace luxfield::hal {
namespace {

constexpr const char* kChip = "gpiochip0";

std::optional<gpiod::LineSettings> ReadOptionalLine(const core::Config& table, const char* key) {
  const auto line = table.OptionalTable(key);
  if (!line) return {};
  return ReadLine(*line);
}

void RequireGpiod(const core::Config& table) {
  table.Choice("driver", {"gpiod"});
  RequireBuilt(table, kHasGpiod, "libgpiod-dev");
}

}  // namespace

gpiod::LineSettings ReadLine(const core::Config& line) {
  using gpiod::Bias;
  gpiod::LineSettings settings;
  settings.line = line.Text("line");
  if (settings.line.empty()) line.Fail("line", "is empty", "give its name or offset");
  settings.active_low = line.Boolean("active_low", false);
  const std::string bias =
      line.Choice("bias", {"as-is", "pull-up", "pull-down", "disabled"}, "as-is");
  settings.bias = bias == "pull-up"     ? Bias::kPullUp
                  : bias == "pull-down" ? Bias::kPullDown
                  : bias == "disabled"  ? Bias::kDisabled
                                        : Bias::kAsIs;
  return settings;
}

gpiod::SafetyInputsOptions ReadInputs(const core::Config& inputs) {
  RequireGpiod(inputs);
  gpiod::SafetyInputsOptions options;
  options.chip = inputs.Text("chip", kChip);
  options.emergency_stop = ReadOptionalLine(inputs, "emergency_stop");
  options.door = ReadOptionalLine(inputs, "door");
  options.limit = ReadOptionalLine(inputs, "limit");
  if (!options.emergency_stop)
    inputs.Fail("emergency_stop", "is missing: no lab of real devices runs without one",
                "name the line of the stop's contact");
  options.assert_s = inputs.Number("assert_s", options.assert_s, {0, 0.015});
  options.release_s = inputs.Number("release_s", options.release_s, {0, 10});
  return options;
}

gpiod::LineSelectorOptions ReadSelector(const core::Config& selector, const std::string& name,
                                        const std::vector<std::string>& positions) {
  RequireGpiod(selector);
  gpiod::LineSelectorOptions options;
  options.name = name;
  options.chip = selector.Text("chip", kChip);
  options.settle_s = selector.Number("settle_s", options.settle_s, {0, 10});
  std::size_t outputs = 0, sensors = 0;
  for (const std::string& position : positions) {
    const core::Config table = selector.Table(position);
    const auto output = ReadOptionalLine(table, "output"),
               sensor = ReadOptionalLine(table, "sensor");
    outputs += output.has_value();
    sensors += sensor.has_value();
    options.positions.push_back({position, output, sensor});
  }
  if (outputs + 1 < positions.size())
    selector.Fail(positions.back(), "and another position have no output", "give one an output");
  if (sensors != 0 && sensors != positions.size())
    selector.Fail(positions.back(), "has no sensor, or another position has none",
                  "give all of them a sensor, or none");
  return options;
}

gpiod::TriggerLineOptions ReadTrigger(const core::Config& trigger) {
  RequireGpiod(trigger);
  gpiod::TriggerLineOptions options;
  options.chip = trigger.Text("chip", kChip);
  options.output = ReadLine(trigger.Table("output"));
  options.pulse_s = trigger.Number("pulse_s", options.pulse_s, {1e-5, 0.1});
  return options;
}

}  // namespace luxfield::hal
