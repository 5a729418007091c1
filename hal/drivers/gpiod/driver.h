#pragma once

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal::gpiod {

Driver Description();

}  // namespace luxfield::hal::gpiod
