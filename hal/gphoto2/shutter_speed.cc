#include "hal/gphoto2/shutter_speed.h"

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
  }
  return text.empty() || text == "s" || text == "\"" ? seconds : std::nullopt;
}

}  // namespace luxfield::hal::gphoto2
