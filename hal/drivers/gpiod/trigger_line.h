// A GPIO line that triggers a camera (docs/formats/lab-and-plan.md, [trigger]). It rests inactive:
// when it is opened, between pulses, and when it is destroyed.
#pragma once

#include <memory>
#include <string>

#include "luxfield/core/clock.h"
#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/trigger.h"

namespace luxfield::hal::gpiod {

struct TriggerLineOptions {
  std::string chip;
  LineSettings output;
  double pulse_s = 0.001;  // how long the line is active, at least: a program may be kept waiting
};

class TriggerLine : public Trigger {
 public:
  TriggerLine(TriggerLineOptions options, std::shared_ptr<core::Clock> clock);
  ~TriggerLine() override;

  std::string identity() const override;
  void Pulse(double deadline_s) override;

 private:
  void Rest() noexcept;

  TriggerLineOptions options_;
  std::shared_ptr<core::Clock> clock_;
  OutputLine line_;
};

}  // namespace luxfield::hal::gpiod
