// What a GenICam camera says of itself, and its features set and read back (EMVA SFNC). All throw
// HardwareError: kRefused where a setting does not read back, kOutOfRange beyond its bounds.
#pragma once

#include <arv.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/hal/drivers/aravis/aravis_camera.h"
#include "luxfield/hal/drivers/aravis/pixel_format.h"

namespace luxfield::hal::aravis {

// Empty: it says nothing.
std::string Firmware(ArvCamera* camera);
// Those that frames are read of.
std::vector<std::string> PixelFormats(ArvCamera* camera);
PixelFormat SetPixelFormat(ArvCamera* camera, const std::string& name, const std::string& wanted);
// Without a line: by software.
void SetTrigger(ArvCamera* camera, const std::string& name,
                const std::optional<LineTrigger>& by_line);
// The bounds within which it can be set.
std::pair<double, double> SetGain(ArvCamera* camera, const std::string& name, double gain);
// Absent: the whole sensor.
Region SetRegion(ArvCamera* camera, const std::string& name, const std::optional<Region>& asked);

}  // namespace luxfield::hal::aravis
