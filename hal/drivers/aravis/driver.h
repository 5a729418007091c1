#pragma once

#include "luxfield/hal/drivers/aravis/aravis_camera.h"
#include "luxfield/hal/drivers/driver.h"

namespace luxfield::hal::aravis {

Driver Description();

// Of [camera]. Throws InputError naming file and field.
AravisOptions ReadOptions(const core::Config& camera);

}  // namespace luxfield::hal::aravis
