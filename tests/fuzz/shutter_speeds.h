// Fuzz target: what a still camera says of its shutter speeds.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/hal/drivers/gphoto2/shutter_speed.h"

namespace luxfield::fuzz {

// The camera's choices, a line each.
inline void ShutterSpeedList(std::string_view input) {
  std::vector<std::string> choices;
  for (std::size_t begin = 0; begin < input.size();) {
    const std::size_t end = std::min(input.find('\n', begin), input.size());
    choices.emplace_back(input.substr(begin, end - begin));
    begin = end + 1;
  }
  double last_s = 0;
  for (const auto& [exposure_s, text] : hal::gphoto2::ShutterSpeeds(choices)) {
    if (!std::isfinite(exposure_s) || exposure_s <= last_s) std::abort();
    last_s = exposure_s;
  }
}

}  // namespace luxfield::fuzz
