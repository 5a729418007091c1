// Where the sun stands: the formulas of "low accuracy" of Meeus, "Astronomical Algorithms" (2nd ed.
// 1998), chapters 12 and 25, the five largest perturbations of his "Astronomical Formulae for
// Calculators" (1982), chapter 18, parallax, and Saemundsson's refraction: 0.004 degrees from 1950
// to 2050, 0.006 with refraction above the horizon, at UT1.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::environment {

// UTC and UT1 are taken for the same (0.9 s, 0.004 degrees).
using UtcTime = std::chrono::sys_seconds;

struct GeographicPosition {
  double latitude_deg = 0;   // north positive
  double longitude_deg = 0;  // east positive
};

struct SunPosition {
  double elevation_deg = 0;           // geometric
  double apparent_elevation_deg = 0;  // lifted by refraction at 1013 hPa and 15 degrees C
  double azimuth_deg = 0;             // from north (0) over east (90)
  double distance_au = 1;
  double angular_radius_deg() const;  // 0.26656 / distance: 0.262 to 0.271
  // Towards the apparent sun; world frame with x to the east, y to the north, z up.
  lightfield::Vec3 direction() const;
};

// Throws InputError for a latitude beyond 90 degrees, a longitude beyond 180, or a year outside of
// 1950 to 2050.
SunPosition FindSun(GeographicPosition where, UtcTime when);

// From the rise of the apparent sun's centre over the horizon to its setting, around the solar noon
// of `day` (that next to 12:00 local mean time), each to a second. A sun that never sets: from
// midnight to midnight. Throws InputError where it does not rise.
struct Daylight {
  UtcTime begin, end;
};
Daylight FindDaylight(GeographicPosition where, std::chrono::sys_days day);

// "2024-06-21"; InputError naming `option` else.
std::chrono::sys_days ParseDate(std::string_view text, std::string_view option);
// "13:05" or "13:05:30" as seconds since midnight; InputError naming `option` else.
std::chrono::seconds ParseTimeOfDay(std::string_view text, std::string_view option);
// "2024-06-21T13:05:30Z"
std::string FormatUtc(UtcTime when);

}  // namespace luxfield::environment
