#include "luxfield/hal/options/instrument_options.h"

#include "luxfield/hal/built_drivers.h"
#include "luxfield/hal/drivers/gpiod/line_selector.h"
#include "luxfield/hal/options/line_options.h"

namespace luxfield::hal {
namespace {

constexpr double kOpen_s = 5;

usbtmc::UsbTmcOptions ReadInstrument(const core::Config& table) {
  usbtmc::UsbTmcOptions options;
  options.vendor = static_cast<std::uint16_t>(table.Integer("vendor", 1, 0xffff));
  options.product = static_cast<std::uint16_t>(table.Integer("product", 0, 0xffff));
  options.serial = table.Text("serial", "");
  options.quirks = usbtmc::FindQuirks(options.vendor, options.product);
  if (const auto quirks = table.OptionalTable("quirks")) {
    options.quirks.no_clear = quirks->Boolean("no_clear", options.quirks.no_clear);
    options.quirks.any_tag = quirks->Boolean("any_tag", options.quirks.any_tag);
    options.quirks.one_header = quirks->Boolean("one_header", options.quirks.one_header);
  }
  return options;
}

}  // namespace

LampSupplyOptions ReadSupply(const core::Config& supply) {
  if (supply.Choice("driver", {"gpiod", "usbtmc"}) == "gpiod") {
    RequireBuilt(supply, kHasGpiod, "libgpiod-dev");
    return RelayOptions{supply.Text("chip", "gpiochip0"), ReadLine(supply.Table("lamp"))};
  }
  UsbSupplyOptions options;
  options.instrument = ReadInstrument(supply);
  options.supply.voltage_v = supply.Number("voltage_v", {0, 1000});
  options.supply.current_a = supply.Number("current_a", {0, 1000});
  options.supply.opc = supply.Boolean("opc", options.supply.opc);
  return options;
}

UsbMeterOptions ReadMonitor(const core::Config& monitor) {
  monitor.Choice("driver", {"usbtmc"});
  UsbMeterOptions options;
  options.instrument = ReadInstrument(monitor);
  options.meter.query = monitor.Text("query", options.meter.query);
  options.meter.unit = monitor.Text("unit", "relative");
  return options;
}

std::unique_ptr<Supply> OpenSupply(const LampSupplyOptions& options,
                                   const std::shared_ptr<core::Clock>& clock) {
  const double deadline_s = clock->MonotonicSeconds() + kOpen_s;
  if (const auto* relay = std::get_if<RelayOptions>(&options)) {
    if constexpr (kHasGpiod)
      return std::make_unique<gpiod::LampRelay>(relay->chip, relay->lamp);  // opens off
    else
      return nullptr;  // ReadSupply has refused it
  }
  const auto& usb = std::get<UsbSupplyOptions>(options);
  auto supply = std::make_unique<scpi::ScpiSupply>(std::make_unique<usbtmc::UsbTmc>(usb.instrument),
                                                   usb.supply, clock, deadline_s);
  supply->SetOutput(false, deadline_s);
  return supply;
}

std::unique_ptr<Meter> OpenMonitor(const UsbMeterOptions& options,
                                   const std::shared_ptr<core::Clock>& clock) {
  return std::make_unique<scpi::ScpiMeter>(std::make_unique<usbtmc::UsbTmc>(options.instrument),
                                           options.meter, clock,
                                           clock->MonotonicSeconds() + kOpen_s);
}

}  // namespace luxfield::hal
