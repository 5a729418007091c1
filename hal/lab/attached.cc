#include "luxfield/hal/lab/attached.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "luxfield/hal/built_drivers.h"
#include "luxfield/hal/drivers/aravis/aravis_camera.h"
#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"
#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/drivers/usbtmc/usbtmc.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal {
namespace {

void AddGpioChips(std::vector<AttachedDevice>& devices) {
  std::vector<std::string> paths;
  std::error_code none;  // a system without /dev has no chips
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none))
    if (entry.path().filename().string().starts_with("gpiochip")) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const std::string& path : paths) {
    AttachedDevice device{"gpiod", path, {}, {}};
    try {
      device.what = gpiod::DescribeChip(path);
    } catch (const HardwareError& error) {
      device.refused = error.what();
    }
    devices.push_back(std::move(device));
  }
}

}  // namespace

std::vector<AttachedDevice> AttachedDevices() {
  std::vector<AttachedDevice> devices;
  if constexpr (kHasAravis)
    for (const auto& camera : aravis::ListAravisDevices())
      devices.push_back({"aravis",
                         camera.id,
                         fmt::format("{} {} {}, {} at {}", camera.vendor, camera.model,
                                     camera.serial, camera.protocol, camera.address),
                         {}});
  if constexpr (kHasGphoto2)
    for (const auto& camera : gphoto2::ListGphoto2Devices())
      devices.push_back({"gphoto2", camera.port, camera.model, {}});
  for (const auto& instrument : usbtmc::ListUsbTmcDevices()) {
    std::vector<std::string> words;
    if (!instrument.serial.empty()) words.push_back("serial " + instrument.serial);
    if (const auto quirks =
            usbtmc::QuirkNames(usbtmc::FindQuirks(instrument.vendor, instrument.product));
        !quirks.empty())
      words.push_back("quirks " + quirks);
    devices.push_back({"usbtmc",
                       fmt::format("{:04x}:{:04x}", instrument.vendor, instrument.product),
                       fmt::format("{}", fmt::join(words, "; ")), instrument.problem});
  }
  if constexpr (kHasGpiod) AddGpioChips(devices);
  return devices;
}

}  // namespace luxfield::hal
