#pragma once

#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal::grbl {

Driver Description();

}  // namespace luxfield::hal::grbl
