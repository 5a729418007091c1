#include "luxfield/hal/drivers/list/drivers.h"

#include <algorithm>

#include "luxfield/hal/drivers/aravis/driver.h"
#include "luxfield/hal/drivers/gphoto2/driver.h"
#include "luxfield/hal/drivers/gpiod/driver.h"
#include "luxfield/hal/drivers/grbl/driver.h"
#include "luxfield/hal/drivers/usbtmc/driver.h"
#include "luxfield/hal/drivers/zaber/driver.h"

namespace luxfield::hal {

std::span<const Driver> AllDrivers() {
  static const std::vector<Driver> drivers = {grbl::Description(),    zaber::Description(),
                                              usbtmc::Description(),  aravis::Description(),
                                              gphoto2::Description(), gpiod::Description()};
  return drivers;
}

const Driver& DriverNamed(std::string_view name) {
  return *std::ranges::find(AllDrivers(), name, &Driver::name);
}

}  // namespace luxfield::hal
