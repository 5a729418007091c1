// The sun's place, the atmosphere's light and the picture of both, against published values and
// hand calculation.
#include "luxfield/environment/sun_sky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/environment_map.h"
#include "luxfield/environment/environment_resampling.h"
#include "luxfield/environment/spherical_polygon.h"

namespace luxfield::environment {
namespace {

using testing::HasSubstr;
using enum EnvironmentLayout;

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

UtcTime At(std::string_view date, std::string_view time) {
  return ParseDate(date, "date") + ParseTimeOfDay(time, "time");
}

SunPosition SunAt(double elevation_deg, double azimuth_deg = 180, double distance_au = 1) {
  return {elevation_deg, elevation_deg, azimuth_deg, distance_au};
}

// Reda and Andreas, NREL/TP-560-34302 (2004), appendix A.5: 17 October 2003, 12:30:30 at UTC-7,
// 39.742476 N, 105.1786 W. Their refraction is for 820 mbar, hence the geometric elevation here.
TEST(SunPosition, IsThatOfTheSolarPositionAlgorithm) {
  const SunPosition sun = FindSun({39.742476, -105.1786}, At("2003-10-17", "19:30:30"));
  EXPECT_NEAR(sun.elevation_deg, 39.872046, 0.01);
  EXPECT_NEAR(sun.azimuth_deg, 194.340241, 0.01);
  EXPECT_NEAR(sun.distance_au, 0.9965422974, 1e-4);
  const lightfield::Vec3 w = sun.direction();
  EXPECT_NEAR(w.z, std::sin(sun.apparent_elevation_deg * kDegree), 1e-12);
  EXPECT_LT(w.y, 0);  // in the south
  EXPECT_LT(w.x, 0);  // past noon in the west
  // Refraction at 40 degrees and on the horizon: 1.2' and 0.5 degrees.
  EXPECT_NEAR(sun.apparent_elevation_deg - sun.elevation_deg, 1.2 / 60, 0.2 / 60);
}

// Geometric place and elevation seen at 1013.25 hPa and 15 degrees C, by libastro (the ephemeris of
// XEphem, through PyEphem 4.2.1), whose own refraction differs by 0.002 degrees: random places and
// times, then the sun within 1.1 degrees of the zenith, where the Almanac's refraction adds 0.010.
TEST(SunPosition, IsThatOfAnEphemeris) {
  const struct {
    double latitude, longitude;
    const char *date, *time;
    double elevation, azimuth, apparent;
  } rows[] = {{-5.4700, 21.5200, "2013-05-17", "14:10:09", 30.4733, 296.3850, 30.5003},
              {-5.5300, 127.8200, "1975-11-06", "01:57:13", 68.9229, 120.4754, 68.9291},
              {-39.1000, 4.2900, "2035-09-23", "15:21:29", 25.4310, 292.4660, 25.4644},
              {-23.1500, -147.3600, "2044-05-18", "00:19:51", 33.0662, 315.6270, 33.0906},
              {15.6000, 34.3600, "2003-12-02", "05:15:30", 16.8994, 119.3022, 16.9515},
              {-60.8900, -167.1600, "1982-12-06", "01:15:36", 44.9059, 313.0514, 44.9219},
              {11.4900, 100.1200, "1994-05-30", "03:08:03", 57.5556, 67.4073, 57.5657},
              {18.9600, -15.3600, "1987-11-10", "13:16:12", 53.1632, 192.3666, 53.1751},
              {24.5600, -66.5000, "1981-04-04", "18:05:26", 60.2476, 235.0230, 60.2567},
              {5.8500, 177.9900, "1955-09-10", "00:04:36", 89.4360, 159.5263, 89.4361},
              {18.7500, 148.0200, "1972-05-13", "02:01:54", 89.3374, 124.1283, 89.3375},
              {-21.1900, -8.8300, "1988-01-16", "12:45:25", 89.7941, 323.0254, 89.7942},
              {12.6900, -140.2100, "2004-04-25", "21:17:21", 89.1103, 21.2020, 89.1106},
              {20.0800, 133.6000, "2026-07-25", "03:08:15", 88.9902, 114.2369, 88.9905},
              {10.2200, -47.6100, "2049-08-26", "15:11:43", 89.8416, 139.7806, 89.8417}};
  for (const auto& row : rows) {
    SCOPED_TRACE(row.date);
    const SunPosition sun = FindSun({row.latitude, row.longitude}, At(row.date, row.time));
    const lightfield::Vec3 seen = SunAt(row.apparent, row.azimuth).direction();
    EXPECT_LT(lightfield::Length(sun.direction() - seen) / kDegree, 0.006);
    EXPECT_NEAR(sun.elevation_deg, row.elevation, 0.004);
  }
}

// Light from the zenith is not bent; below the horizon the lift stays what it is there.
TEST(SunPosition, RefractionEndsInTheZenithAndOnTheHorizon) {
  const auto lift = [](double latitude, std::string_view time) {
    const SunPosition sun = FindSun({latitude, 0}, At("2024-06-20", time));
    return std::pair{sun.elevation_deg, sun.apparent_elevation_deg - sun.elevation_deg};
  };
  const auto [zenith, none] = lift(23.436, "12:01:40");  // noon of 20 June, 0.4 degrees off at most
  EXPECT_GT(zenith, 89.6);
  EXPECT_NEAR(none, 0, 2e-4);
  const auto [night, night_lift] = lift(23.436, "23:00");
  const auto [dusk, dusk_lift] = lift(23.436, "19:00");
  EXPECT_LT(night, -40);
  EXPECT_LT(dusk, -1);
  EXPECT_DOUBLE_EQ(night_lift, dusk_lift);
  EXPECT_NEAR(night_lift, 34.0 / 60, 0.5 / 60);
}

TEST(SunPosition, TurnsWithTheYear) {
  // The instants of 2024 by the Astronomical Almanac: equinox 20 March 03:06, solstices 20 June
  // 20:51 and 21 December 09:21, perihelion 3 January. At the pole the elevation is the
  // declination.
  EXPECT_NEAR(FindSun({90, 0}, At("2024-03-20", "03:06")).elevation_deg, 0, 0.01);
  EXPECT_NEAR(FindSun({90, 0}, At("2024-06-20", "20:51")).elevation_deg, 23.436, 0.01);
  EXPECT_NEAR(FindSun({-90, 0}, At("2024-12-21", "09:21")).elevation_deg, 23.436, 0.01);
  EXPECT_NEAR(FindSun({0, 0}, At("2024-01-03", "01:00")).distance_au, 0.98331, 1e-4);
  EXPECT_NEAR(2 * FindSun({0, 0}, At("2024-01-03", "01:00")).angular_radius_deg(), 0.542, 1e-3);
  EXPECT_NEAR(2 * FindSun({0, 0}, At("2024-07-05", "05:00")).angular_radius_deg(), 0.524, 1e-3);
}

TEST(SunPosition, RisesAndSets) {
  // NREL's example again: 06:12:43 on the 17th and 17:20:19 local time, which is the sunset of that
  // date in UTC, the 16th's; for the upper rim at 0.8333 degrees below the horizon. Our centre at
  // apparent 0 is at geometric -0.56, 88 s later at 15 degrees an hour and this latitude.
  const Daylight day = FindDaylight({39.742476, -105.1786}, ParseDate("2003-10-17", ""));
  const Daylight before = FindDaylight({39.742476, -105.1786}, ParseDate("2003-10-16", ""));
  EXPECT_NEAR(double((day.begin - At("2003-10-17", "13:12:43")).count()), 88, 8);
  EXPECT_NEAR(double((At("2003-10-17", "00:20:19") - before.end).count()), 88, 8);
  for (const UtcTime t : {day.begin, day.end})
    EXPECT_NEAR(FindSun({39.742476, -105.1786}, t).apparent_elevation_deg, 0, 0.01);
  // Midnight sun and polar night.
  const Daylight arctic = FindDaylight({80, 20}, ParseDate("2024-06-21", ""));
  EXPECT_EQ(arctic.end - arctic.begin, std::chrono::hours(24));
  EXPECT_THROW(FindDaylight({80, 20}, ParseDate("2024-12-21", "")), InputError);
}

TEST(SunPosition, RefusesWhatIsNoPlaceOrTime) {
  EXPECT_THROW(FindSun({90.1, 0}, At("2024-01-01", "00:00")), InputError);
  EXPECT_THROW(FindSun({0, NAN}, At("2024-01-01", "00:00")), InputError);
  EXPECT_THROW(FindSun({0, 0}, At("1949-12-31", "23:59")), InputError);
  EXPECT_THROW(FindSun({0, 0}, At("2051-01-01", "00:00")), InputError);
  for (const char* date : {"2024-02-30", "2024-2-03", "24-02-03", "", "2024-06-21 "})
    EXPECT_THROW(ParseDate(date, "--date"), InputError) << date;
  for (const char* time : {"24:00", "12:60", "12:00:60", "1:00", "12", "12:00:00:00"})
    EXPECT_THROW(ParseTimeOfDay(time, "--time"), InputError) << time;
  EXPECT_EQ(FormatUtc(At("2024-02-29", "23:05:09")), "2024-02-29T23:05:09Z");
}

// A latitude-longitude picture is summed pixel by pixel, nothing of the model in it.
core::Rgb HorizontalIlluminance(const core::Image& image) {
  core::Rgb sum{};
  for (int row = 0; row < image.height / 2; ++row) {
    const double t0 = kPi * row / image.height, t1 = kPi * (row + 1) / image.height;
    const double projected = kPi * (std::cos(2 * t0) - std::cos(2 * t1)) / 2 / image.width;
    for (int column = 0; column < image.width; ++column)
      for (int k = 0; k < 3; ++k) sum[k] += projected * image.at(k, row, column);
  }
  return sum;
}

TEST(SunSky, PictureHoldsTheEnergyOfSkyAndSun) {
  for (const double elevation : {8.0, 33.0, 77.0}) {
    SCOPED_TRACE(elevation);
    const SunSky sky(SunAt(elevation, 200), 3, 0.2);
    const core::Image image = sky.Picture(kLatitudeLongitude, 128);
    const core::Rgb sum = HorizontalIlluminance(image);
    // A pixel of 1.4 degrees moves the sun by up to half of it: its share of the cosine.
    const double moved = 0.5 * kPi / 128 * std::cos(elevation * kDegree);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(sum[k], sky.global_horizontal()[k],
                  moved * sky.direct_normal()[k] + 2e-3 * sky.diffuse_horizontal()[k]);
    // And the sun's own, the picture without it taken away.
    const CubeResampler resampler(kLatitudeLongitude, TexelRegistration::kCells, 256, 128, 8);
    double energy = 0;
    for (int row = 0; row < 128; ++row)
      for (int column = 0; column < 256; ++column) {
        const double solid_angle = resampler.source_solid_angles()[row * 256 + column];
        const lightfield::Vec3 w =
            DirectionFromPicture(kLatitudeLongitude, {(column + 0.5) / 256, (row + 0.5) / 128})
                ->direction;
        const double angle = std::acos(std::min(1.0, lightfield::Dot(w, sky.sun_direction())));
        // Within a tenth of the sun: what the sky leaves there is known to a promille.
        if (angle < 0.05) energy += solid_angle * (image.at(1, row, column) - sky.Radiance(w)[1]);
      }
    const double disc = 2 * kPi * (1 - std::cos(sky.sun_angular_radius()));
    EXPECT_NEAR(energy / (disc * sky.sun_radiance()[1]), 1, 1e-3);
  }
}

TEST(SunSky, TheDiscKeepsItsEnergyAtEverySizeAndLayout) {
  const SunSky sky(FindSun({48.1, 11.6}, At("2024-03-05", "10:10")), 2.2, 0);
  const double disc = 2 * kPi * (1 - std::cos(sky.sun_angular_radius()));
  const struct {
    EnvironmentLayout layout;
    int height;
  } cases[] = {{kLatitudeLongitude, 32}, {kLatitudeLongitude, 301}, {kCube, 6 * 50},
               {kAngularMap, 97},        {kMirrorBall, 64},         {kFisheyeHemisphere, 211},
               {kFisheyeHemisphere, 600}};
  for (const auto& c : cases) {
    SCOPED_TRACE(testing::Message() << EnvironmentLayoutName(c.layout) << " " << c.height);
    const core::Image image = sky.Picture(c.layout, c.height);
    const TexelEdges edges =
        MakeTexelEdges(c.layout, TexelRegistration::kCells, image.width, image.height);
    // The sky is 1e5 times darker: what is above it is the sun.
    double energy = 0;
    float peak = 0;
    for (int row = 0; row < image.height; ++row)
      for (int column = 0; column < image.width; ++column) {
        const float value = image.at(0, row, column);
        peak = std::max(peak, value);
        if (value < 30000) continue;
        energy += value * PictureRectangleSolidAngle(c.layout, edges.x[column], edges.x[column + 1],
                                                     edges.y[row], edges.y[row + 1]);
      }
    // Sky in the sun's pixels, pixels that it only touches: what the threshold leaves.
    EXPECT_NEAR(energy / (disc * sky.sun_radiance()[0]), 1, 2e-2);
    EXPECT_GT(peak, 65504);
    EXPECT_LT(peak, 1.01 * sky.sun_radiance()[0]);
  }
  // Resolved: pixels inside of the disc hold its radiance, 1.6e9 cd/m2 outside of the atmosphere.
  const core::Image fine = sky.Picture(kFisheyeHemisphere, 1200);
  const float peak = *std::max_element(fine.data.begin(), fine.data.begin() + fine.plane_size());
  EXPECT_NEAR(peak / sky.sun_radiance()[0], 1, 1e-4);
  EXPECT_GT(core::Luminance(sky.sun_radiance()), 1e9);
  EXPECT_LT(core::Luminance(sky.sun_radiance()), 2e9);
}

TEST(SunSky, TheHorizonCutsTheDisc) {
  const SunSky sky(SunAt(0, 90), 2, 0.5);
  const core::Image image = sky.Picture(kLatitudeLongitude, 256);
  // East, +x, is a quarter from the left edge. What is left without sky and ground is the sun.
  double above = 0, below = 0;
  for (int row = 0; row < 256; ++row)
    for (int column = 124; column < 132; ++column) {
      const lightfield::Vec3 w =
          DirectionFromPicture(kLatitudeLongitude, {(column + 0.5) / 512, (row + 0.5) / 256})
              ->direction;
      const double solid_angle = PictureRectangleSolidAngle(
          kLatitudeLongitude, column / 512.0, (column + 1) / 512.0, row / 256.0, (row + 1) / 256.0);
      (row < 128 ? above : below) += solid_angle * (image.at(0, row, column) - sky.Radiance(w)[0]);
    }
  const double disc = 2 * kPi * (1 - std::cos(sky.sun_angular_radius()));
  EXPECT_NEAR(above, 0.5 * disc * sky.sun_radiance()[0], 5e-3 * above);  // the sky in few nodes
  EXPECT_NEAR(below, 0, 1e-6 * above);
}

TEST(SunSky, RefusesSizes) {
  const SunSky sky(SunAt(30), 3, 0);
  for (const int height : {0, -5, 31, 8193})
    EXPECT_THROW(sky.Picture(kLatitudeLongitude, height), InputError) << height;
  EXPECT_THROW(sky.Picture(kCube, 200), InputError);
  EXPECT_EQ(sky.Picture(kCube, 192).width, 32);
}

TEST(CapOverlap, TilesTheCapAndMatchesTheClosedForms) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  core::Random random(kSeed, 0);
  for (int trial = 0; trial < 200; ++trial) {
    const double z = 2 * random.Uniform() - 1, phi = 2 * kPi * random.Uniform();
    const double s = std::sqrt(1 - z * z);
    const lightfield::Vec3 axis = {s * std::cos(phi), s * std::sin(phi), z};
    const double radius = std::pow(10.0, -3 + 3.1 * random.Uniform());  // to 1.26
    const double cap = 4 * kPi * std::pow(std::sin(radius / 2), 2);
    // The faces of the cube in 2 x 2 pieces tile the sphere, hence the cap.
    double sum = 0;
    for (const CubeFace& face : kCubeFaces)
      for (int piece = 0; piece < 4; ++piece) {
        const double x = piece % 2 - 1, y = piece / 2 - 1;
        const auto at = [&](double a, double b) {
          return face.axis + a * face.right + b * face.up;
        };
        const lightfield::Vec3 quad[] = {at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)};
        const double part = CapOverlapSolidAngle(quad, axis, radius);
        EXPECT_GE(part, -1e-14 * cap);
        EXPECT_LE(part, std::min(cap, PolygonSolidAngle(quad)) * (1 + 1e-12));
        sum += part;
      }
    EXPECT_NEAR(sum / cap, 1, 1e-12) << radius;
    // A hemisphere's border through the axis halves it: an octant-like triangle with its corner on
    // the axis holds the angle's share.
    const lightfield::Vec3 u = lightfield::Normalized(lightfield::Cross(
        axis, std::abs(axis.z) < 0.9 ? lightfield::Vec3{0, 0, 1} : lightfield::Vec3{1, 0, 0}));
    const lightfield::Vec3 v = lightfield::Cross(axis, u);
    const double wedge = 0.1 + 2 * random.Uniform();
    const lightfield::Vec3 triangle[] = {axis, u, std::cos(wedge) * u + std::sin(wedge) * v};
    EXPECT_NEAR(CapOverlapSolidAngle(triangle, axis, radius) / (cap * wedge / (2 * kPi)), 1, 1e-9);
  }
}

}  // namespace
}  // namespace luxfield::environment
