#include "luxfield/hal/drivers/gpiod/driver.h"

#include <algorithm>
#include <filesystem>

#include "luxfield/hal/drivers/gpiod/gpio_lines.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::gpiod {
namespace {

#ifdef LUXFIELD_LIBGPIOD
constexpr bool kBuilt = true;

std::vector<AttachedDevice> Attached() {
  std::vector<std::string> paths;
  std::error_code none;  // a system without /dev has no chips
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none))
    if (entry.path().filename().string().starts_with("gpiochip")) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<AttachedDevice> devices;
  for (const std::string& path : paths) {
    AttachedDevice& device = devices.emplace_back(AttachedDevice{"gpiod", path, {}, {}});
    try {
      device.what = DescribeChip(path);
    } catch (const HardwareError& error) {
      device.refused = error.what();
    }
  }
  return devices;
}
#else
constexpr bool kBuilt = false;
#endif

}  // namespace

Driver Description() {
  Driver driver{
      "gpiod",
      "GPIO lines: safety inputs, shutter, print changer, colour wheel, trigger, lamp relay",
      kBuilt,
      "libgpiod-dev",
      {},
      {},
      {}};
#ifdef LUXFIELD_LIBGPIOD
  driver.attached = Attached;
#endif
  return driver;
}

}  // namespace luxfield::hal::gpiod
