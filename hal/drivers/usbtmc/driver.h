#pragma once

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal::usbtmc {

Driver Description();

}  // namespace luxfield::hal::usbtmc
