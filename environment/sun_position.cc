#include "luxfield/environment/sun_position.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "luxfield/core/error.h"

namespace luxfield::environment {
namespace {

using std::chrono::days;
using std::chrono::seconds;

constexpr double kDegree = std::numbers::pi / 180;

// Lifted by refraction, degrees: Saemundsson (Sky and Telescope 72, 1986, 70) by 1.02 minutes of
// arc times cot(e + 10.3 / (e + 5.11)), for 1010 hPa and 10 degrees C and within 0.1 minute of the
// tables, less what it leaves at 90 degrees, where light is not bent. Below the horizon: the lift
// of an apparent elevation of 0.
double ApparentElevation(double elevation_deg) {
  constexpr double kToStandardAir = 1013.25 / 1010 * 283.15 / 288.15;
  constexpr double kGeometricHorizon = -0.56414;  // whose lift is 0.56414
  const double e = std::max(elevation_deg, kGeometricHorizon);
  const auto minutes = [](double x) { return 1.02 / std::tan(kDegree * (x + 10.3 / (x + 5.11))); };
  return elevation_deg + kToStandardAir * (minutes(e) - minutes(90)) / 60;
}

// What Venus, Jupiter and the moon add to the sun's longitude, degrees; in centuries since 1900.
double PerturbationDeg(double t) {
  return 0.00134 * std::cos(kDegree * (153.23 + 22518.7541 * t)) +
         0.00154 * std::cos(kDegree * (216.57 + 45037.5082 * t)) +
         0.00200 * std::cos(kDegree * (312.69 + 32964.3577 * t)) +
         0.00179 * std::sin(kDegree * (350.74 + 445267.1142 * t)) +
         0.00178 * std::sin(kDegree * (231.19 + 20.20 * t));
}

// A time between a and b, on whose sides the sun is up and not up.
UtcTime Crossing(GeographicPosition where, UtcTime up, UtcTime down) {
  while (std::chrono::abs(up - down) > seconds(1)) {
    const UtcTime middle = down + (up - down) / 2;
    (FindSun(where, middle).apparent_elevation_deg >= 0 ? up : down) = middle;
  }
  return up;
}

// Exactly the characters of `pattern`, 0 standing for a digit.
bool Matches(std::string_view text, std::string_view pattern) {
  if (text.size() != pattern.size()) return false;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (pattern[k] == '0' ? text[k] < '0' || text[k] > '9' : text[k] != pattern[k]) return false;
  return true;
}

int Digits(std::string_view text) {
  int value = 0;
  for (const char c : text) value = 10 * value + (c - '0');
  return value;
}

}  // namespace

double SunPosition::angular_radius_deg() const { return 959.63 / 3600 / distance_au; }

lightfield::Vec3 SunPosition::direction() const {
  const double e = kDegree * apparent_elevation_deg, a = kDegree * azimuth_deg;
  return {std::cos(e) * std::sin(a), std::cos(e) * std::cos(a), std::sin(e)};
}

SunPosition FindSun(GeographicPosition where, UtcTime when) {
  if (!(std::abs(where.latitude_deg) <= 90 && std::abs(where.longitude_deg) <= 180))
    throw InputError(
        fmt::format("latitude {}, longitude {} is no place; give -90 to 90 and -180 to 180 degrees",
                    where.latitude_deg, where.longitude_deg));
  const auto day = std::chrono::floor<days>(when);
  const int year = int(std::chrono::year_month_day(day).year());
  if (year < 1950 || year > 2050)
    throw InputError(
        fmt::format("the year {} is outside of 1950 to 2050, where the sun's position is known to "
                    "0.01 degrees",
                    year));
  constexpr auto kJ2000 =
      std::chrono::sys_days(std::chrono::January / 1 / 2000) + std::chrono::hours(12);
  const double n = double((when - kJ2000).count()) / 86400;
  // Mean longitude and anomaly, the equation of the centre, aberration, and nutation by the moon's
  // node, in degrees and Julian centuries.
  const double t = n / 36525;
  const double mean_longitude = 280.46646 + t * (36000.76983 + t * 0.0003032);
  const double anomaly = kDegree * (357.52911 + t * (35999.05029 - t * 0.0001537));
  const double centre = (1.914602 - t * 0.004817) * std::sin(anomaly) +
                        (0.019993 - t * 0.000101) * std::sin(2 * anomaly) +
                        0.000289 * std::sin(3 * anomaly);
  const double by_planets = PerturbationDeg(t + 1);
  const double node = kDegree * (125.04 - t * 1934.136);
  const double nutation = -0.00478 * std::sin(node);
  const double longitude = kDegree * (mean_longitude + centre + by_planets - 0.00569 + nutation);
  const double obliquity = kDegree * (23.439291 - t * 0.0130042 + 0.00256 * std::cos(node));
  const double right_ascension =
      std::atan2(std::cos(obliquity) * std::sin(longitude), std::cos(longitude));
  const double declination = std::asin(std::sin(obliquity) * std::sin(longitude));
  const double sidereal_deg =
      280.46061837 + 360.98564736629 * n + nutation * std::cos(obliquity) + where.longitude_deg;
  const double hour_angle = kDegree * sidereal_deg - right_ascension;
  const double latitude = kDegree * where.latitude_deg;

  // Components towards east, north and up.
  const double east = -std::cos(declination) * std::sin(hour_angle);
  const double north = std::sin(declination) * std::cos(latitude) -
                       std::cos(declination) * std::sin(latitude) * std::cos(hour_angle);
  const double up = std::sin(declination) * std::sin(latitude) +
                    std::cos(declination) * std::cos(latitude) * std::cos(hour_angle);
  SunPosition sun;
  const double eccentricity = 0.016708634 - t * 0.000042037;
  sun.distance_au = 1.000001018 * (1 - eccentricity * eccentricity) /
                    (1 + eccentricity * std::cos(anomaly + kDegree * centre));
  // Seen from the earth's surface, not its centre: parallax.
  const double level = std::hypot(east, north);
  sun.elevation_deg = std::atan2(up, level) / kDegree - 8.794 / 3600 / sun.distance_au * level;
  sun.apparent_elevation_deg = ApparentElevation(sun.elevation_deg);
  sun.azimuth_deg = std::atan2(east, north) / kDegree;
  if (sun.azimuth_deg < 0) sun.azimuth_deg += 360;
  return sun;
}

Daylight FindDaylight(GeographicPosition where, std::chrono::sys_days day) {
  const UtcTime mean_noon =
      UtcTime(day) + std::chrono::hours(12) - seconds(std::llround(240 * where.longitude_deg));
  const auto is_up = [where](UtcTime t) { return FindSun(where, t).apparent_elevation_deg >= 0; };
  // Where a day is short the highest point matters: it lies within 17 minutes of mean noon.
  UtcTime noon = mean_noon;
  double highest = -90;
  for (auto t = mean_noon - seconds(1080); t <= mean_noon + seconds(1080); t += seconds(30))
    if (const double e = FindSun(where, t).elevation_deg; e > highest) highest = e, noon = t;
  if (!is_up(noon))
    throw InputError(
        fmt::format("at latitude {} the sun does not rise that day: {:.2f} degrees at its highest; "
                    "choose another date or place",
                    where.latitude_deg, highest));
  const UtcTime before = noon - std::chrono::hours(12), after = noon + std::chrono::hours(12);
  return {is_up(before) ? before : Crossing(where, noon, before),
          is_up(after) ? after : Crossing(where, noon, after)};
}

std::chrono::sys_days ParseDate(std::string_view text, std::string_view option) {
  if (Matches(text, "0000-00-00")) {
    const std::chrono::year_month_day date(
        std::chrono::year(Digits(text.substr(0, 4))),
        std::chrono::month(static_cast<unsigned>(Digits(text.substr(5, 2)))),
        std::chrono::day(static_cast<unsigned>(Digits(text.substr(8, 2)))));
    if (date.ok()) return date;
  }
  throw InputError(fmt::format("{} '{}' is no date; write it like 2024-06-21", option, text));
}

std::chrono::seconds ParseTimeOfDay(std::string_view text, std::string_view option) {
  if (Matches(text, "00:00") || Matches(text, "00:00:00")) {
    const int h = Digits(text.substr(0, 2)), m = Digits(text.substr(3, 2)),
              s = text.size() > 5 ? Digits(text.substr(6, 2)) : 0;
    if (h < 24 && m < 60 && s < 60) return seconds(3600 * h + 60 * m + s);
  }
  throw InputError(
      fmt::format("{} '{}' is no time of day; write it like 13:05 or 13:05:30", option, text));
}

std::string FormatUtc(UtcTime when) {
  const auto day = std::chrono::floor<days>(when);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss time(when - day);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", int(date.year()),
                     unsigned(date.month()), unsigned(date.day()), time.hours().count(),
                     time.minutes().count(), time.seconds().count());
}

}  // namespace luxfield::environment
