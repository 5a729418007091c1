#pragma once

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal::zaber {

Driver Description();

}  // namespace luxfield::hal::zaber
