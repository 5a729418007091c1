#pragma once

#include "luxfield/hal/drivers/driver.h"
#include "luxfield/hal/drivers/gphoto2/gphoto2_camera.h"

namespace luxfield::hal::gphoto2 {

Driver Description();

// Of [camera]. Throws InputError naming file and field.
Gphoto2Options ReadOptions(const core::Config& camera);

}  // namespace luxfield::hal::gphoto2
