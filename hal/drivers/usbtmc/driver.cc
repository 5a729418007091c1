#include "luxfield/hal/drivers/usbtmc/driver.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "luxfield/hal/drivers/usbtmc/usbtmc.h"

namespace luxfield::hal::usbtmc {
namespace {

std::vector<AttachedDevice> Attached() {
  std::vector<AttachedDevice> devices;
  for (const auto& instrument : ListUsbTmcDevices()) {
    std::vector<std::string> words;
    if (!instrument.serial.empty()) words.push_back("serial " + instrument.serial);
    if (const auto quirks = QuirkNames(FindQuirks(instrument.vendor, instrument.product));
        !quirks.empty())
      words.push_back("quirks " + quirks);
    devices.push_back({"usbtmc",
                       fmt::format("{:04x}:{:04x}", instrument.vendor, instrument.product),
                       fmt::format("{}", fmt::join(words, "; ")), instrument.problem});
  }
  return devices;
}

}  // namespace

Driver Description() {
  return {"usbtmc", "SCPI lamp supply and light meter on USB", true, "", {}, {}, Attached};
}

}  // namespace luxfield::hal::usbtmc
