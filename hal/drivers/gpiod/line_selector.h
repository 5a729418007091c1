// A device of named positions on GPIO lines: remote shutter, filter changer.
//
// Each position may have an output, active while the position is chosen, and a sensor, active while
// the device stands there. A remote shutter has one output (of "open") and mostly no sensor; a
// changer has an output and a sensor for every position. Outputs of other positions are switched
// off before the chosen one is switched on.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "luxfield/core/clock.h"
#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/instruments.h"

namespace luxfield::hal::gpiod {

struct LinePosition {
  std::string name;
  std::optional<LineSettings> output, sensor;
};

struct LineSelectorOptions {
  std::string name;  // of the device, for messages
  std::string chip;
  // Two or more; the first is where the device goes when it is opened: name the safe one. Either
  // all have a sensor or none; at most one has no output.
  std::vector<LinePosition> positions;
  double settle_s = 0.05;  // after the sensor, or without one after the output
};

class LineSelector : public Selector {
 public:
  // Throws InputError for positions that do not make sense, HardwareError.
  LineSelector(LineSelectorOptions options, std::shared_ptr<core::Clock> clock);

  std::string identity() const override;
  std::vector<std::string> positions() const override;
  // kTimeout where the sensor does not report the position by the deadline, kRefused where an
  // output does not read back as it was set.
  void Select(const std::string& position, double deadline_s) override;
  // By the sensors, else by the outputs. kProtocol where no sensor or several are active.
  std::string Current() override;

 private:
  std::size_t IndexOf(const std::string& position) const;
  std::optional<std::size_t> Sensed();
  void AwaitSensor(std::size_t index, double deadline_s);

  LineSelectorOptions options_;
  std::shared_ptr<core::Clock> clock_;
  std::vector<std::unique_ptr<OutputLine>> outputs_;  // of the positions, null where there is none
  std::optional<InputLines> sensors_;
};

// The lamp behind a relay: on or off, voltage and current not measured (NaN). Off when it is opened
// and when it is destroyed.
class LampRelay : public Supply {
 public:
  LampRelay(std::string chip, LineSettings line);
  ~LampRelay() override;

  std::string identity() const override;
  SupplyState SetOutput(bool on, double deadline_s) override;
  SupplyState State() override;

 private:
  std::string chip_, name_;
  OutputLine line_;
};

}  // namespace luxfield::hal::gpiod
