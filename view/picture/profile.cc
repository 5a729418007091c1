#include "luxfield/view/picture/profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace luxfield::view {

std::vector<Reading> ProfileOf(const render::Frame& frame, PicturePlace from, PicturePlace to) {
  const double x0 = from.x * frame.width, y0 = from.y * frame.height;
  const double x1 = to.x * frame.width, y1 = to.y * frame.height;
  const double columns = std::abs(std::floor(x1) - std::floor(x0)),
               rows = std::abs(std::floor(y1) - std::floor(y0));
  const int steps = static_cast<int>(std::max(columns, rows));
  std::vector<Reading> profile;
  for (int i = 0; i <= steps; ++i) {
    const double t = steps > 0 ? static_cast<double>(i) / steps : 0;
    const auto reading = ReadAt(frame, static_cast<int>(std::floor(std::lerp(x0, x1, t))),
                                static_cast<int>(std::floor(std::lerp(y0, y1, t))));
    if (!reading) return {};
    profile.push_back(*reading);
  }
  return profile;
}

std::string TableOf(const std::vector<Reading>& profile, lightfield::FluxUnit unit) {
  const std::string radiance = render::RadianceUnitName(unit);
  std::string text = fmt::format(
      "column\trow\tluminance in {0}\tsigma in {0}\tdirect illuminance in {1}\tx in m\ty in m\tz "
      "in "
      "m\n",
      radiance, render::IrradianceUnitName(unit));
  const auto number = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.6g}", *value) : std::string();
  };
  for (const Reading& reading : profile) {
    text += fmt::format("{}\t{}\t{:.6g}\t{}\t{}", reading.column, reading.row, reading.luminance,
                        number(reading.luminance_sigma), number(reading.illuminance));
    if (reading.position)
      text += fmt::format("\t{:.6g}\t{:.6g}\t{:.6g}", reading.position->x, reading.position->y,
                          reading.position->z);
    else
      text += "\t\t\t";
    text += '\n';
  }
  return text;
}

}  // namespace luxfield::view
