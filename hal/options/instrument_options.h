// The [supply] and [monitor] of a lab of real devices (docs/formats/lab-and-plan.md).
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "luxfield/core/clock.h"
#include "luxfield/core/config.h"
#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/drivers/scpi/scpi.h"
#include "luxfield/hal/drivers/usbtmc/usbtmc.h"

namespace luxfield::hal {

struct RelayOptions {
  std::string chip;
  gpiod::LineSettings lamp;
};
struct UsbSupplyOptions {
  usbtmc::UsbTmcOptions instrument;
  scpi::SupplyOptions supply;
};
using LampSupplyOptions = std::variant<RelayOptions, UsbSupplyOptions>;

struct UsbMeterOptions {
  usbtmc::UsbTmcOptions instrument;
  scpi::MeterOptions meter;
};

// Throw InputError naming file and field.
LampSupplyOptions ReadSupply(const core::Config& supply);
UsbMeterOptions ReadMonitor(const core::Config& monitor);

// Opened and switched off.
std::unique_ptr<Supply> OpenSupply(const LampSupplyOptions& options,
                                   const std::shared_ptr<core::Clock>& clock);
std::unique_ptr<Meter> OpenMonitor(const UsbMeterOptions& options,
                                   const std::shared_ptr<core::Clock>& clock);

}  // namespace luxfield::hal
