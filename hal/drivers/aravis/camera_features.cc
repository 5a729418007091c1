#include "luxfield/hal/drivers/aravis/camera_features.h"

#if LUXFIELD_ARAVIS

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "luxfield/core/printable.h"
#include "luxfield/hal/drivers/aravis/result.h"

namespace luxfield::hal::aravis {
namespace {

void RequireReadBack(ArvCamera* camera, const std::string& name, const char* feature,
                     const std::string& value) {
  Result result(name, "set trigger");
  const char* set = arv_camera_get_string(camera, feature, result);
  result.ThrowIfFailed();
  if (!set || value != set)
    throw Refused(name, "set trigger",
                  fmt::format("{} {} reads back as {}", feature, value, set ? set : "none"));
}

}  // namespace

PixelFormat SetPixelFormat(ArvCamera* camera, const std::string& name, const std::string& wanted) {
  Result result(name, "set up");
  const auto found = FindPixelFormat(wanted);
  if (!found)
    throw Refused(name, "set up",
                  fmt::format("pixel format \"{}\" is not read; those that are: {}", wanted,
                              PixelFormatNames()));
  const PixelFormat format = *found;
  arv_camera_set_pixel_format_from_string(camera, wanted.c_str(), result);
  result.ThrowIfFailed();
  const char* set = arv_camera_get_pixel_format_as_string(camera, result);
  result.ThrowIfFailed();
  if (!set || format.name != set)
    throw Refused(name, "set up",
                  fmt::format("pixel format {} reads back as {}", format.name, set ? set : "none"));
  return format;
}

// SFNC has a feature for it, which older cameras lack. Only reported: an answer that fails, or
// differs when it is asked again, is none.
std::string Firmware(ArvCamera* camera) {
  for (const char* feature : {"DeviceFirmwareVersion", "DeviceVersion"}) {
    if (!arv_camera_is_feature_available(camera, feature, nullptr)) continue;
    const auto read = [&] {
      const char* text = arv_camera_get_string(camera, feature, nullptr);
      return std::string(text ? text : "");
    };
    if (const std::string text = read(); !text.empty() && text == read())
      return core::Printable(text);
  }
  return {};
}

// Only listed: one that cannot be asked has none.
std::vector<std::string> PixelFormats(ArvCamera* camera) {
  guint count = 0;
  const std::unique_ptr<const char*, decltype(&g_free)> names(
      arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr), g_free);
  std::vector<std::string> formats;
  for (guint k = 0; names && k < count; ++k)
    if (const char* found = names.get()[k]; FindPixelFormat(found)) formats.emplace_back(found);
  return formats;
}

// aravis sets selector FrameStart where a camera has it, mode, source and a rising edge.
void SetTrigger(ArvCamera* camera, const std::string& name,
                const std::optional<LineTrigger>& by_line) {
  Result result(name, "set trigger");
  arv_camera_set_trigger(camera, by_line ? by_line->source.c_str() : "Software", result);
  result.ThrowIfFailed();
  if (!by_line) return;
  arv_camera_set_string(camera, "TriggerActivation", by_line->activation.c_str(), result);
  result.ThrowIfFailed();
  if (arv_camera_is_feature_available(camera, "TriggerSelector", nullptr))
    RequireReadBack(camera, name, "TriggerSelector", "FrameStart");
  RequireReadBack(camera, name, "TriggerMode", "On");
  RequireReadBack(camera, name, "TriggerSource", by_line->source);
  RequireReadBack(camera, name, "TriggerActivation", by_line->activation);
}

std::pair<double, double> SetGain(ArvCamera* camera, const std::string& name, double gain) {
  Result result(name, "set gain");
  if (!arv_camera_is_gain_available(camera, nullptr)) {
    if (gain != 0) throw Refused(name, "set gain", "the camera's gain cannot be set");
    return {0, 0};
  }
  double least = 0, most = 0;
  arv_camera_get_gain_bounds(camera, &least, &most, result);
  result.ThrowIfFailed();
  if (!(gain >= least && gain <= most))
    throw HardwareError(Fault::kOutOfRange, name, "set gain",
                        fmt::format("{} is not within {} to {}", gain, least, most),
                        "choose a gain that the camera has");
  arv_camera_set_gain(camera, gain, result);
  result.ThrowIfFailed();
  const double set = arv_camera_get_gain(camera, result);
  result.ThrowIfFailed();
  // Registers hold steps of the gain; half a hundredth of a decibel is 0.06 % of the signal.
  if (std::abs(set - gain) > 0.005)
    throw Refused(name, "set gain", fmt::format("asked for {}, reads back {}", gain, set));
  return {least, most};
}

Region SetRegion(ArvCamera* camera, const std::string& name, const std::optional<Region>& asked) {
  Result result(name, "set region");
  int width = 0, height = 0;
  arv_camera_get_sensor_size(camera, &width, &height, result);
  result.ThrowIfFailed();
  const Region wanted = asked.value_or(Region{0, 0, width, height});
  if (wanted.x < 0 || wanted.y < 0 || wanted.width < 1 || wanted.height < 1 ||
      wanted.x + wanted.width > width || wanted.y + wanted.height > height)
    throw HardwareError(
        Fault::kOutOfRange, name, "set region",
        fmt::format("{} x {} pixels at ({}, {}) are not within the sensor of {} x {}", wanted.width,
                    wanted.height, wanted.x, wanted.y, width, height),
        "choose a region of the sensor");
  arv_camera_set_region(camera, wanted.x, wanted.y, wanted.width, wanted.height, result);
  result.ThrowIfFailed();
  const Region set = Agreed(name, "set region", [camera](GError** error) {
    Region read;
    arv_camera_get_region(camera, &read.x, &read.y, &read.width, &read.height, error);
    return read;
  });
  if (set != wanted)
    throw Refused(
        name, "set region",
        fmt::format("asked for {} x {} at ({}, {}), reads back {} x {} at ({}, {})", wanted.width,
                    wanted.height, wanted.x, wanted.y, set.width, set.height, set.x, set.y));
  return set;
}

}  // namespace luxfield::hal::aravis

#endif
