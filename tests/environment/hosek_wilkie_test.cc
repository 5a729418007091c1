// The sky's radiance against numbers of the program that its authors published, and sun and sky
// against the standard formulas of daylight.
#include "luxfield/environment/hosek_wilkie.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/environment/hosek_wilkie_data.h"
#include "luxfield/environment/sun_sky.h"
#include "luxfield/environment/sunlight.h"

namespace luxfield::environment {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

SunPosition SunAt(double elevation_deg, double azimuth_deg = 0, double distance_au = 1) {
  return {elevation_deg, elevation_deg, azimuth_deg, distance_au};
}

// Sums and sums weighted by the position, 1 to n, of the numbers of ArHosekSkyModelData_CIEXYZ.h:
// any wrong digit, and any two numbers exchanged, show.
TEST(HosekWilkie, TablesAreThePublishedOnes) {
  const double expected[3][4] = {
      {290.4991173229273, 140425.46386996147, 1055.5191867, 74725.94256730004},
      {291.00493287876463, 136794.4516341382, 1118.4457695999997, 79076.9928542},
      {241.95430413204085, 111870.35329270083, 1378.6013657, 95468.4960405}};
  const auto sums = [](const auto& table) {
    double sum = 0, weighted = 0;
    for (std::size_t k = 0; k < table.size(); ++k) {
      sum += table[k];
      weighted += double(k + 1) * table[k];
    }
    return std::pair{sum, weighted};
  };
  for (int c = 0; c < 3; ++c) {
    const auto distribution = sums(kHosekWilkieXyz[c].distribution);
    const auto radiance = sums(kHosekWilkieXyz[c].radiance);
    EXPECT_NEAR(distribution.first, expected[c][0], 1e-9);
    EXPECT_NEAR(distribution.second, expected[c][1], 1e-7);
    EXPECT_NEAR(radiance.first, expected[c][2], 1e-9);
    EXPECT_NEAR(radiance.second, expected[c][3], 1e-7);
  }
}

// Tristimulus values, cd/m2, by arhosek_tristim_skymodel_radiance of the authors'
// ArHosekSkyModel.c, version 1.4a, compiled as it is, times 683 lm/W; printed with seven digits.
// Random states with the extremes of turbidity, elevation and albedo.
TEST(HosekWilkie, RadianceIsThatOfTheAuthorsProgram) {
  const struct {
    double turbidity, sun_elevation, albedo, elevation, azimuth_from_sun, x, y, z;
  } rows[] = {{7.68, 0, 1, 90, 180, 308.1989, 332.8556, 411.0685},
              {2, 1.18, 0, 14.2, 0, 3806.234, 3914.309, 2469.909},
              {2, 8.68, 1, 18, 174, 5019.425, 5593.205, 7232.577},
              {2, 7.91, 0.2, 11.9, 90, 3887.911, 4330.557, 5339.38},
              {2, 2.06, 0.36, 24.1, 0, 2684.129, 2868.781, 2627.771},
              {5.08, 85.97, 0.2, 85.97, 90, 21605.44, 23195.03, 25181.28},
              {1, 1.5, 0, 29.5, 180, 1400.996, 1526.107, 1516.04},
              {10, 1.46, 0, 18.6, 82, 934.2759, 984.2467, 897.2867},
              {9.81, 1.5, 1, 90, 90, 510.2898, 547.2344, 700.1532},
              {3, 1.5, 0.98, 21.3, 90, 1559.138, 1715.763, 1702.168},
              {1, 86.38, 0.2, 15.8, 90, 7255.703, 7718.077, 14227.31},
              {3, 32.71, 0.2, 86.2, 0, 2276.104, 2340.876, 4803.295},
              {3, 73.5, 0.2, 73.5, 180, 3887.1, 3974.201, 7733.822},
              {3, 1.5, 0.2, 90, 129.5, 485.5382, 515.3559, 674.2742},
              {2.55, 28.09, 0.2, 65.4, 180, 2006.437, 2068.297, 4401.597},
              {7.17, 1.5, 1, 5, 0, 8244.069, 7244.86, 2274.792},
              {4.16, 90, 0, 90, 90, 17989.44, 19902.04, 17884.87},
              {3, 16.36, 0.2, 13.7, 180, 6538.621, 7221.372, 10271.1},
              {2, 31.6, 0, 30.7, 58.6, 4018.648, 4281.378, 7879.242},
              {10, 1.5, 0.2, 10.4, 90, 718.3567, 747.7627, 659.7871},
              {3, 12.9, 0, 90, 90, 1211.344, 1254.791, 2506.54},
              {1, 90, 0.29, 90, 180, 3996.241, 4566.847, 8585.225},
              {3, 90, 1, 90, 0, 12020.53, 12387.85, 16992.09},
              {1, 53.54, 0.71, 53.54, 180, 3806.341, 3918.911, 8892.634},
              {1, 0.1, 0.29, 5, 125.1, 1749.816, 1721.39, 810.8954},
              {10, 1.5, 0, 90, 59.9, 490.7491, 526.1379, 669.9278},
              {9.99, 3.7, 0, 5.8, 127, 1069.228, 1121.467, 1062.246},
              {10, 2.02, 0.11, 90, 180, 596.5024, 634.631, 789.9214},
              {1.82, 90, 1, 6.2, 180, 21763.1, 23662.24, 35136.56},
              {3, 1.5, 0.86, 90, 0, 515.8932, 548.8907, 731.6149},
              {1, 45.58, 0.2, 45.58, 180, 2809.494, 2903.282, 6652.255},
              {2, 67.46, 1, 63.7, 90, 5213.711, 5360.96, 11408.8},
              {4.4, 74.8, 0.2, 47.5, 133.2, 4303.198, 4483.09, 8692.175},
              {2, 18.22, 0.2, 18.22, 58.2, 5213.183, 5691.808, 8823.356},
              {2, 6.41, 0.2, 24.9, 0, 4562.514, 4905.417, 5498.867},
              {3, 28.45, 1, 20.7, 180, 7823.51, 8486.74, 13951.31},
              {2, 17.24, 0.2, 7.2, 51, 8707.091, 9597.734, 11920.57},
              {3.16, 54.78, 0, 54.78, 0, 12616.06, 13781.69, 15700.32},
              {5.94, 1.5, 0.9, 10.1, 116, 1828.151, 1945.725, 1518.603},
              {3, 0, 1, 5, 180, 1725.295, 1717.47, 890.8935},
              {1, 0, 1, 14.4, 87.6, 1314.827, 1419.835, 1098.146},
              {1, 1.5, 1, 4.5, 90, 2745.564, 2904.99, 1669.431},
              {10, 2.53, 0.2, 90, 90, 699.36, 741.2209, 910.2527},
              {1, 9.42, 0.2, 90, 0, 1048.373, 1088.638, 2073.555}};
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << "T " << row.turbidity << ", sun " << row.sun_elevation
                                    << ", at " << row.elevation << ", " << row.azimuth_from_sun);
    const HosekWilkieSky sky(row.sun_elevation, row.turbidity, row.albedo);
    const lightfield::Vec3 w = SunAt(row.elevation, row.azimuth_from_sun).direction();
    const lightfield::Vec3 sun = SunAt(row.sun_elevation).direction();
    const double gamma =
        std::atan2(lightfield::Length(lightfield::Cross(w, sun)), lightfield::Dot(w, sun));
    const core::Rgb xyz = sky.Xyz(w.z, gamma, std::cos(gamma));
    EXPECT_NEAR(xyz[0], row.x, 1e-6 * row.x);
    EXPECT_NEAR(xyz[1], row.y, 1e-6 * row.y);
    EXPECT_NEAR(xyz[2], row.z, 1e-6 * row.z);
  }
}

// By the same program over albedo 0.2: the sky's illuminance (32768 directions), the luminance of
// the zenith, and of what stands 5 degrees high at a right azimuth to the sun and under it.
TEST(HosekWilkie, IlluminanceAndLuminanceOfTheSkyPicture) {
  const struct {
    double turbidity, elevation, diffuse, zenith, aside;
  } rows[] = {{3, 10, 9298, 1173, 6160},
              {3, 30, 14948, 2135, 9644},
              {3, 60, 17644, 3863, 11489},
              {2, 45, 14439, 2493, 10917},
              {5, 45, 24076, 3871, 10786}};
  for (const auto& row : rows) {
    const SunSky sky(SunAt(row.elevation, 215), row.turbidity, 0.2);
    const auto luminance = [&](double elevation, double azimuth) {
      return core::Luminance(sky.Radiance(SunAt(elevation, azimuth).direction()));
    };
    EXPECT_NEAR(core::Luminance(sky.diffuse_horizontal()) / row.diffuse, 1, 1e-3);
    EXPECT_NEAR(luminance(90, 0), row.zenith, 0.5 + 1e-4 * row.zenith);
    EXPECT_NEAR(luminance(5, 215 + 90), row.aside, 0.5 + 1e-4 * row.aside);
    EXPECT_NEAR(luminance(5, 215 - 90), row.aside, 0.5 + 1e-4 * row.aside);
  }
  const SunSky low(SunAt(10, 215), 3, 0.2);
  EXPECT_NEAR(core::Luminance(low.Radiance(SunAt(5, 215).direction())), 37770, 5);
}

// The light of a sun at another distance; blue above, and the ground's grey below.
TEST(HosekWilkie, SunSkyShowsIt) {
  const SunSky near(SunAt(30, 215, 0.98331), 3, 0.2), sky(SunAt(30, 215), 3, 0.2);
  const core::Rgb zenith = sky.Radiance({0, 0, 1});
  const double nearness = 1 / (0.98331 * 0.98331);
  EXPECT_NEAR(near.Radiance({0, 0, 1})[1] / zenith[1], nearness, 1e-12);
  EXPECT_NEAR(near.diffuse_horizontal()[1] / sky.diffuse_horizontal()[1], nearness, 1e-12);
  EXPECT_NEAR(near.direct_normal()[1] / sky.direct_normal()[1], nearness, 1e-9);
  EXPECT_GT(zenith[2], 2 * zenith[0]);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(sky.Radiance({0.6, 0, -0.8})[k],
                0.2 / std::numbers::pi * sky.global_horizontal()[k], 1e-9 * zenith[k]);
}

// "Recommended practice for the calculation of daylight availability", IES RP-21, J. Illum. Eng.
// Soc. 13 (1984) 381, for clear skies, averages of measurements: direct normal
// 127.5 klx exp(-0.21 / sin h), sky on the horizontal 0.8 + 15.5 sqrt(sin h) klx. Turbidity 2; the
// model's skies are brighter than those of the formula.
TEST(HosekWilkie, SunAndSkyAgainstTheStandardFormulas) {
  for (const double h : {10.0, 20.0, 30.0, 45.0, 60.0, 75.0, 90.0}) {
    const double sine = std::sin(h * kDegree);
    const SunSky sky(SunAt(h), 2, 0.2);
    const double direct = 127500 * std::exp(-0.21 / sine);
    const double diffuse = 800 + 15500 * std::sqrt(sine);
    const double direct_ratio = core::Luminance(sky.direct_normal()) / direct,
                 diffuse_ratio = core::Luminance(sky.diffuse_horizontal()) / diffuse;
    std::printf("  sun %2.0f degrees high: direct %.3f, diffuse %.3f of IES RP-21\n", h,
                direct_ratio, diffuse_ratio);
    EXPECT_NEAR(direct_ratio, 1, 0.03);
    EXPECT_NEAR(diffuse_ratio, 1.08, 0.1);
  }
}

TEST(HosekWilkie, RefusesNightAndWhatIsOutOfReach) {
  EXPECT_THROW(HosekWilkieSky(-0.01, 3, 0), InputError);
  EXPECT_THROW(HosekWilkieSky(10, 0.99, 0), InputError);
  EXPECT_THROW(HosekWilkieSky(10, 10.1, 0), InputError);
  EXPECT_THROW(HosekWilkieSky(10, NAN, 0), InputError);
  EXPECT_THROW(HosekWilkieSky(10, 3, 1.01), InputError);
}

// The fit goes below 0 next to the horizon of a low sun in haze.
TEST(HosekWilkie, IsNeverNegative) {
  const HosekWilkieSky sky(2, 10, 0.2);
  for (const double azimuth : {0.0, 90.0, 120.0, 180.0})
    for (const double elevation : {0.0, 0.01, 0.1, 1.0, 90.0}) {
      const lightfield::Vec3 w = SunAt(elevation, azimuth).direction();
      const double cosine = lightfield::Dot(w, SunAt(2).direction());
      for (const double value : sky.Xyz(w.z, std::acos(cosine), cosine)) EXPECT_GE(value, 0);
    }
}

// One wavelength by hand: with the spectrum's own transmittances at 550 nm the luminance of the
// direct light cannot be far off, as the eye peaks there. Air mass 2, turbidity 3.
TEST(Sunlight, FollowsItsTransmittances) {
  // Luminous solar constant: 133.1 klx by the WRC spectrum (Darula, Kittler and Gueymard, Solar
  // Energy 79, 2005: 133.3).
  EXPECT_NEAR(core::Luminance(ExtraterrestrialIlluminance()), 133300, 0.005 * 133300);
  const double elevation = 29.92;  // Kasten and Young: 1.9998
  const double beta = 0.04608 * 3 - 0.04586, thickness = beta * std::pow(0.55, -1.3);
  const double um4 = 0.55 * 0.55 * 0.55 * 0.55;
  const double t = std::exp(-2 / (um4 * (115.6406 - 1.335 / (0.55 * 0.55)))) *
                   std::exp(-2 * thickness) * std::exp(-0.085 * 0.35 * 1.98);
  const auto direct = [](double sun_elevation, double turbidity) {
    return DirectNormalIlluminance(SunAt(sun_elevation), turbidity);
  };
  EXPECT_NEAR(
      core::Luminance(direct(elevation, 3)) / core::Luminance(ExtraterrestrialIlluminance()), t,
      0.03 * t);
  EXPECT_LT(direct(elevation, 6)[1], direct(elevation, 3)[1]);
  // A low sun is redder.
  EXPECT_GT(direct(2, 3)[0] / direct(2, 3)[2],
            5 * direct(elevation, 3)[0] / direct(elevation, 3)[2]);
  for (const double c : direct(0, 10)) EXPECT_GE(c, 0);
}

}  // namespace
}  // namespace luxfield::environment
