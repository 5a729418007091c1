#include "luxfield/render/device/device_tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "luxfield/core/error.h"
#include "luxfield/render/device/device.h"

namespace luxfield::render {

std::string DeviceTuning::BuildOptions() const {
  return fmt::format("-cl-std=CL1.2 -D PIXELS={} -D SHARED={} -D LANES={}{}", pixels_per_item,
                     shared_loads, lanes,
                     exact_divide ? " -cl-fp32-correctly-rounded-divide-sqrt" : "");
}

std::string DeviceTuning::Text() const {
  return fmt::format("group={},pixels={},shared={},lanes={},divide={},rays={}", group_size,
                     pixels_per_item, shared_loads, lanes, static_cast<int>(exact_divide),
                     static_cast<int>(host_rays));
}

DeviceTuning TuningOf(const DeviceInfo& info) {
  DeviceTuning tuning;
  tuning.exact_divide = info.has_exact_divide;
  tuning.host_rays = info.is_cpu;
  if (info.is_cpu) {
    tuning.lanes = info.native_float_lanes >= 16 ? 16 : info.native_float_lanes >= 8 ? 8 : 4;
    // Its vectoriser, 2025.3 and 2026.2, loses items of a group where loops diverge within loops.
    if (info.platform.starts_with("Intel(R)")) tuning.group_size = 1;
  } else {
    tuning.group_size = 64;
    tuning.pixels_per_item = tuning.shared_loads = 2;
  }
  return tuning;
}

DeviceTuning ParseTuning(const std::string& text, const DeviceTuning& base) {
  const auto refuse = [&](const std::string& problem) {
    throw InputError(
        fmt::format("tuning '{}': {}; write for instance {}", text, problem, base.Text()));
  };
  DeviceTuning tuning = base;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    begin = end + 1;
    const auto equals = std::min(part.find('='), part.size());
    const std::string name = part.substr(0, equals),
                      number = part.substr(std::min(equals + 1, part.size()));
    int value = 0;
    const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error != std::errc{} || stop != number.data() + number.size())
      refuse(fmt::format("'{}' is no NAME=NUMBER", part));
    if (name == "group")
      tuning.group_size = value;
    else if (name == "pixels")
      tuning.pixels_per_item = value;
    else if (name == "shared")
      tuning.shared_loads = value;
    else if (name == "lanes")
      tuning.lanes = value;
    else if (name == "divide")
      tuning.exact_divide = value != 0;
    else if (name == "rays")
      tuning.host_rays = value != 0;
    else
      refuse(fmt::format("'{}' is unknown", name));
  }
  if (tuning.group_size < 1 || tuning.group_size > 4096) refuse("group must be 1 to 4096");
  if (tuning.shared_loads != 1 && tuning.shared_loads != 2 && tuning.shared_loads != 4)
    refuse("shared must be 1, 2 or 4");
  if (tuning.lanes != 4 && tuning.lanes != 8 && tuning.lanes != 16)
    refuse("lanes must be 4, 8 or 16");
  if (tuning.pixels_per_item < 1 || tuning.pixels_per_item > 64 ||
      tuning.pixels_per_item % tuning.shared_loads != 0)
    refuse("pixels must be 1 to 64, a multiple of shared");
  return tuning;
}

}  // namespace luxfield::render
