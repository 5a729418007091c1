// Shutter speeds as cameras write them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::hal::gphoto2 {

// Seconds of "1/60", "0.3", "1.3", "30", "0.0166s" or "2\""; nothing for what is no time of the
// camera's own, as "bulb", "Auto" or "x 1/250", and for what is no finite time above 0.
std::optional<double> ParseShutterSpeed(std::string_view text);

struct ShutterSpeed {
  double exposure_s = 0;
  std::string text;  // the camera's
};

// The speeds among a camera's choices, shortest first; of choices for the same time the first.
std::vector<ShutterSpeed> ShutterSpeeds(const std::vector<std::string>& choices);

}  // namespace luxfield::hal::gphoto2
