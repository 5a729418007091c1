// Shutter speeds as cameras write them.
#pragma once

#include <optional>
#include <string_view>

namespace luxfield::hal::gphoto2 {

// Seconds of "1/60", "0.3", "1.3", "30", "0.0166s" or "2\""; nothing for what is no time of the
// camera's own, as "bulb", "Auto" or "x 1/250".
std::optional<double> ParseShutterSpeed(std::string_view text);

}  // namespace luxfield::hal::gphoto2
