#include "luxfield/hal/drivers/gpiod/line_selector.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "luxfield/hal/drivers/gpiod/gpio_error.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::gpiod {
namespace {

constexpr double kLook_s = 0.1;  // sensors are read this often even without an edge

void Check(const LineSelectorOptions& options) {
  const auto& positions = options.positions;
  const auto sensors = std::count_if(positions.begin(), positions.end(),
                                     [](const LinePosition& p) { return p.sensor.has_value(); });
  const auto outputs = std::count_if(positions.begin(), positions.end(),
                                     [](const LinePosition& p) { return p.output.has_value(); });
  const auto count = static_cast<std::ptrdiff_t>(positions.size());
  if (count < 2)
    throw InputError(options.name, fmt::format("has {} positions", count), "give two or more");
  if (sensors != 0 && sensors != count)
    throw InputError(options.name,
                     fmt::format("has sensors at {} of its {} positions", sensors, count),
                     "give a sensor line for every position, or none");
  if (outputs < count - 1)
    throw InputError(options.name,
                     fmt::format("has outputs for {} of its {} positions", outputs, count),
                     "give an output line for every position but one at most");
}

}  // namespace

LineSelector::LineSelector(LineSelectorOptions options, std::shared_ptr<core::Clock> clock)
    : options_(std::move(options)), clock_(std::move(clock)) {
  Check(options_);
  std::vector<LineSettings> sensors;
  for (std::size_t k = 0; k < options_.positions.size(); ++k) {
    const LinePosition& position = options_.positions[k];
    outputs_.push_back(position.output
                           ? std::make_unique<OutputLine>(options_.chip, *position.output, k == 0)
                           : nullptr);
    if (position.sensor) sensors.push_back(*position.sensor);
  }
  if (!sensors.empty()) sensors_.emplace(options_.chip, sensors);
}

std::string LineSelector::identity() const {
  return fmt::format("{} on {}", options_.name, ChipPath(options_.chip));
}

std::vector<std::string> LineSelector::positions() const {
  std::vector<std::string> names;
  for (const LinePosition& position : options_.positions) names.push_back(position.name);
  return names;
}

std::size_t LineSelector::IndexOf(const std::string& position) const {
  for (std::size_t k = 0; k < options_.positions.size(); ++k)
    if (options_.positions[k].name == position) return k;
  throw HardwareError(Fault::kOutOfRange, identity(), "select",
                      fmt::format("has no position \"{}\"", position),
                      fmt::format("choose one of {}", fmt::join(positions(), ", ")));
}

void LineSelector::Select(const std::string& position, double deadline_s) {
  const std::size_t index = IndexOf(position);
  for (std::size_t k = 0; k < outputs_.size(); ++k)
    if (outputs_[k] && k != index) outputs_[k]->Set(false);
  if (outputs_[index]) outputs_[index]->Set(true);
  for (std::size_t k = 0; k < outputs_.size(); ++k)
    if (outputs_[k] && outputs_[k]->Get() != (k == index))
      throw HardwareError(Fault::kRefused, identity(), "select " + position,
                          fmt::format("the output of position \"{}\" does not read back as set",
                                      options_.positions[k].name),
                          "check for a short, or a second driver on the pin");
  if (sensors_) AwaitSensor(index, deadline_s);
  if (clock_->MonotonicSeconds() + options_.settle_s > deadline_s)
    throw HardwareError(Fault::kTimeout, identity(), "select " + position,
                        "has not settled by its deadline", "allow more time");
  clock_->SleepSeconds(options_.settle_s);
}

std::optional<std::size_t> LineSelector::Sensed() {
  const std::vector<bool> levels = sensors_->Levels();
  if (std::count(levels.begin(), levels.end(), true) != 1) return {};
  return std::find(levels.begin(), levels.end(), true) - levels.begin();
}

void LineSelector::AwaitSensor(std::size_t index, double deadline_s) {
  const std::string& position = options_.positions[index].name;
  for (;;) {
    sensors_->DrainEdges();
    if (Sensed() == index) return;
    const double left = deadline_s - clock_->MonotonicSeconds();
    if (left <= 0)
      throw HardwareError(Fault::kTimeout, identity(), "select " + position,
                          "its sensor has not reported the position",
                          "free the changer, then check its drive and its sensors' wires");
    std::vector<pollfd> fds;
    for (const int fd : sensors_->edge_fds()) fds.push_back({fd, POLLIN, 0});
    poll(fds.data(), fds.size(), static_cast<int>(std::ceil(1e3 * std::min(left, kLook_s))));
  }
}

std::string LineSelector::Current() {
  if (sensors_) {
    if (const auto index = Sensed()) return options_.positions[*index].name;
    throw HardwareError(Fault::kProtocol, identity(), "read the position",
                        "not exactly one of its sensors is active",
                        "select a position, then check the sensors' wires");
  }
  std::size_t without = 0;
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    if (!outputs_[k])
      without = k;
    else if (outputs_[k]->Get())
      return options_.positions[k].name;
  }
  return options_.positions[without].name;
}

LampRelay::LampRelay(std::string chip, LineSettings line)
    : chip_(std::move(chip)), name_(line.line), line_(chip_, line, false) {}

LampRelay::~LampRelay() {
  try {
    line_.Set(false);
  } catch (const HardwareError&) {
    // The adapter is gone, and its pins with it: nothing is left to switch.
  }
}

std::string LampRelay::identity() const {
  return fmt::format("lamp relay {} on {}", name_, ChipPath(chip_));
}

SupplyState LampRelay::SetOutput(bool on, double) {
  line_.Set(on);
  const SupplyState state = State();
  if (state.output != on)
    throw HardwareError(Fault::kRefused, identity(), on ? "switch on" : "switch off",
                        "the line does not read back as set",
                        "check for a short, or a second driver on the pin");
  return state;
}

SupplyState LampRelay::State() {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  return {kUnknown, kUnknown, line_.Get()};
}

}  // namespace luxfield::hal::gpiod
