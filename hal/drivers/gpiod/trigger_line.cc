#include "luxfield/hal/drivers/gpiod/trigger_line.h"

#include <fmt/format.h>

#include <utility>

#include "luxfield/hal/drivers/gpiod/gpio_error.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::gpiod {

TriggerLine::TriggerLine(TriggerLineOptions options, std::shared_ptr<core::Clock> clock)
    : options_(std::move(options)),
      clock_(std::move(clock)),
      line_(options_.chip, options_.output, false) {}

TriggerLine::~TriggerLine() { Rest(); }

void TriggerLine::Rest() noexcept {
  try {
    line_.Set(false);
  } catch (const HardwareError&) {
    // The adapter is gone, and its pins with it.
  }
}

std::string TriggerLine::identity() const {
  return fmt::format("trigger {} on {}", options_.output.line, ChipPath(options_.chip));
}

void TriggerLine::Pulse(double deadline_s) {
  if (clock_->MonotonicSeconds() + options_.pulse_s > deadline_s)
    throw HardwareError(Fault::kTimeout, identity(), "pulse",
                        fmt::format("the deadline leaves no {} s for it", options_.pulse_s),
                        "allow more time");
  bool followed = false;
  try {
    line_.Set(true);
    followed = line_.Get();
    clock_->SleepSeconds(options_.pulse_s);
    line_.Set(false);
    followed = followed && !line_.Get();
  } catch (const HardwareError&) {
    Rest();
    throw;
  }
  if (!followed)
    throw HardwareError(Fault::kRefused, identity(), "pulse", "the line does not read back as set",
                        "check for a short, or a second driver on the pin");
}

}  // namespace luxfield::hal::gpiod
