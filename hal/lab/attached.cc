#include "luxfield/hal/lab/attached.h"

#include "luxfield/hal/drivers/list/drivers.h"

namespace luxfield::hal {

std::vector<AttachedDevice> AttachedDevices() {
  std::vector<AttachedDevice> devices;
  for (const bool cameras : {true, false})  // cameras first
    for (const Driver& driver : AllDrivers()) {
      if (!driver.attached || cameras != bool(driver.read_camera)) continue;
      const std::vector<AttachedDevice> found = driver.attached();
      devices.insert(devices.end(), found.begin(), found.end());
    }
  return devices;
}

}  // namespace luxfield::hal
