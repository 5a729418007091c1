#include "luxfield/hal/drivers/gphoto2/shutter_speed.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace luxfield::hal::gphoto2 {
namespace {

// The number that `text` begins with, which is cut off.
std::optional<double> TakeNumber(std::string_view* text) {
  double value = 0;
  const auto [end, error] =
      std::from_chars(text->data(), text->data() + text->size(), value, std::chars_format::fixed);
  if (error != std::errc() || !std::isfinite(value) || value <= 0) return std::nullopt;
  text->remove_prefix(static_cast<std::size_t>(end - text->data()));
  return value;
}

}  // namespace

std::optional<double> ParseShutterSpeed(std::string_view text) {
  auto seconds = TakeNumber(&text);
  if (!seconds) return std::nullopt;
  if (text.starts_with('/')) {
    text.remove_prefix(1);
    const auto divisor = TakeNumber(&text);
    if (!divisor) return std::nullopt;
    *seconds /= *divisor;
    if (!std::isfinite(*seconds) || *seconds <= 0) return std::nullopt;
  }
  return text.empty() || text == "s" || text == "\"" ? seconds : std::nullopt;
}

std::vector<ShutterSpeed> ShutterSpeeds(const std::vector<std::string>& choices) {
  std::vector<ShutterSpeed> speeds;
  for (const std::string& choice : choices)
    if (const auto exposure_s = ParseShutterSpeed(choice)) speeds.push_back({*exposure_s, choice});
  std::stable_sort(speeds.begin(), speeds.end(), [](const ShutterSpeed& a, const ShutterSpeed& b) {
    return a.exposure_s < b.exposure_s;
  });
  const auto same = [](const ShutterSpeed& a, const ShutterSpeed& b) {
    return a.exposure_s == b.exposure_s;
  };
  speeds.erase(std::unique(speeds.begin(), speeds.end(), same), speeds.end());
  return speeds;
}

}  // namespace luxfield::hal::gphoto2
