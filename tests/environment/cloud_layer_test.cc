// Clouds: their statistics, their drift, the light they let through against a simulation of
// photons, and the sky that they make.
#include "luxfield/environment/cloud_layer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/core/error.h"
#include "luxfield/core/parallel.h"
#include "luxfield/core/random.h"
#include "luxfield/environment/sun_sky.h"

namespace luxfield::environment {
namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
constexpr UtcTime kNoon =
    std::chrono::sys_days(std::chrono::year(2024) / 6 / 21) + std::chrono::hours(12);

SunPosition SunAt(double elevation_deg, double azimuth_deg = 180) {
  return {elevation_deg, elevation_deg, azimuth_deg, 1};
}

CloudOptions Clouds(double cover, std::uint64_t seed = 1) {
  CloudOptions options;
  options.cover = cover;
  options.seed = seed;
  return options;
}

// Optical thickness at places tens of kilometres apart in the layers of many seeds: nearly
// independent values. Cover by its binomial deviation, and the mean inside of clouds by that of a
// Weibull distribution, whose deviation is not above its mean; 4.5 deviations each.
TEST(CloudLayer, CoverAndThicknessAreWhatWasAsked) {
  constexpr int kSeeds = 12, kSide = 9;
  for (const double cover : {0.1, 0.4, 0.85}) {
    SCOPED_TRACE(testing::Message() << "cover " << cover << ", seeds 1 to " << kSeeds);
    int clouds = 0, places = 0;
    double sum = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const CloudLayer layer(Clouds(cover, seed), kNoon, {0, 0, 1});
      for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i, ++places) {
          const double tau = layer.OpticalThickness({47.3e3 * i, 47.3e3 * j});
          clouds += tau > 0;
          sum += tau;
        }
    }
    EXPECT_NEAR(double(clouds) / places, cover, 4.5 * std::sqrt(cover * (1 - cover) / places));
    EXPECT_NEAR(sum / clouds, 12, 4.5 * 12 / std::sqrt(double(clouds)));
  }
}

// Mean, variance and fourth moment of a normal distribution at points between the lattices' nodes.
TEST(CloudField, IsNormalAndLosesWhatASquareAverages) {
  constexpr int kSeeds = 60, kSide = 6;
  double m1 = 0, m2 = 0, m4 = 0;
  int count = 0;
  double covariance = 0, smooth = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const CloudField field(seed, 2000);
    EXPECT_EQ(field.At({0, 0}, 1e5).mean, 0);
    EXPECT_NEAR(field.At({0, 0}, 1e5).sigma, 1, 1e-12);
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i, ++count) {
        const lightfield::Vec2 p = {27e3 * i + 431, 27e3 * j + 97};
        const auto point = field.At(p, 0), square = field.At(p, 300);
        EXPECT_EQ(point.sigma, 0);
        m1 += point.mean;
        m2 += point.mean * point.mean;
        m4 += std::pow(point.mean, 4);
        covariance += square.mean * (point.mean - square.mean);
        smooth += square.mean * square.mean + square.sigma * square.sigma;
      }
  }
  const double n = count;
  EXPECT_NEAR(m1 / n, 0, 4.5 / std::sqrt(n));
  EXPECT_NEAR(m2 / n, 1, 4.5 * std::sqrt(2 / n));
  EXPECT_NEAR(m4 / n, 3, 4.5 * std::sqrt(96 / n));
  EXPECT_NEAR(smooth / n, 1, 4.5 * std::sqrt(2 / n));
  EXPECT_GT(covariance / n, 0);
}

TEST(CloudLayer, DriftsWithTheWind) {
  CloudOptions options = Clouds(0.5, 7);
  options.wind_m_s = 10;
  options.wind_from_deg = 270;  // from the west: to the east, +x
  const CloudLayer before(options, kNoon, {0, 0, 1});
  const CloudLayer after(options, kNoon + std::chrono::seconds(90), {0, 0, 1});
  int clouds = 0;
  for (int k = 0; k < 200; ++k) {
    const lightfield::Vec2 p = {137.0 * k, -53.0 * k};
    const double tau = before.OpticalThickness(p);
    clouds += tau > 0;
    EXPECT_NEAR(after.OpticalThickness({p.x + 900, p.y}), tau, 1e-3 * (0.1 + tau));
  }
  EXPECT_GT(clouds, 40);
  EXPECT_LT(clouds, 160);
  const CloudLayer other(Clouds(0.5, 8), kNoon, {0, 0, 1});
  EXPECT_NE(other.OpticalThickness({0, 0}), before.OpticalThickness({0, 0}));
}

// What goes down through a slab that scatters by Henyey and Greenstein's g = 0.85 and absorbs
// nothing, photon by photon.
double SimulatedTransmission(double tau, double cosine, int photons, std::uint64_t seed) {
  constexpr double g = 0.85;
  core::Random random(seed, 0);
  int through = 0;
  for (int k = 0; k < photons; ++k) {
    double depth = 0;
    lightfield::Vec3 w = {std::sqrt(1 - cosine * cosine), 0, cosine};  // z down
    for (;;) {
      depth -= w.z * std::log1p(-random.Uniform());
      if (depth < 0 || depth > tau) break;
      const double s = (1 - g * g) / (1 - g + 2 * g * random.Uniform());
      const double c = (1 + g * g - s * s) / (2 * g), sine = std::sqrt(std::max(0.0, 1 - c * c));
      const double phi = 2 * kPi * random.Uniform();
      const lightfield::Vec3 u = lightfield::Normalized(lightfield::Cross(
          w, std::abs(w.z) < 0.9 ? lightfield::Vec3{0, 0, 1} : lightfield::Vec3{1, 0, 0}));
      w = lightfield::Normalized(c * w + sine * (std::cos(phi) * u + std::sin(phi) * Cross(w, u)));
    }
    through += depth > tau;
  }
  return double(through) / photons;
}

TEST(CloudLayer, LetsThroughWhatPhotonsSay) {
  constexpr int kPhotons = 4000;
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  for (const double tau : {0.5, 2.0, 8.0, 30.0})
    for (const double cosine : {0.3, 0.6, 0.95}) {
      const double simulated = SimulatedTransmission(tau, cosine, kPhotons, kSeed);
      // Delta-Eddington is within 0.03 (Joseph, Wiscombe and Weinman 1976); four deviations.
      EXPECT_NEAR(TransmittedSunlight(tau, cosine), simulated,
                  0.03 + 4 * std::sqrt(simulated * (1 - simulated) / kPhotons))
          << "tau " << tau << ", cosine " << cosine;
    }
  EXPECT_NEAR(UnscatteredSunlight(2, 0.5), std::exp(-4.0), 1e-15);
  EXPECT_EQ(TransmittedSunlight(0, 0.4), 1);
  EXPECT_NEAR(TransmittedSkylight(20), 1 / (1 + 0.75 * 0.15 * 20), 1e-3);
}

// A thick closed layer: (1 + 2 sin) / 3 of the zenith (Moon and Spencer 1942), whose flux is
// 7 pi / 9 of it. Means over the layer, as a wide line of sight has them; 2e-3 for what thin places
// let through.
TEST(CloudLayer, ClosedItIsTheOvercastSkyOfTheCie) {
  CloudOptions options = Clouds(1);
  options.optical_thickness = 60;
  const SunSky sky(SunAt(35), 3, 0.2, options, kNoon);
  EXPECT_NEAR(core::Luminance(sky.direct_normal()), 0, 1e-3);
  EXPECT_NEAR(sky.cloud_cover(), 1, 1e-9);
  constexpr double kWide = 1e3;
  const double zenith = core::Luminance(sky.Radiance({0, 0, 1}, kWide));
  const double region = core::Luminance(sky.region_horizontal());
  for (const double elevation : {2.0, 10.0, 30.0, 60.0})
    for (const double azimuth : {0.0, 90.0, 180.0})
      EXPECT_NEAR(
          core::Luminance(sky.Radiance(SunAt(elevation, azimuth).direction(), kWide)) / zenith,
          (1 + 2 * std::sin(elevation * kDegree)) / 3, 2e-3)
          << elevation;
  EXPECT_NEAR(region / (7 * kPi / 9 * zenith), 1, 2e-3);
  EXPECT_NEAR(core::Luminance(sky.Radiance({0, 0, -1})) / (0.2 / kPi * region), 1, 1e-6);
  // The one place's illuminance is the region's within what the layer's unevenness leaves.
  EXPECT_NEAR(core::Luminance(sky.diffuse_horizontal()) / region, 1, 0.5);
}

double Horizontal(const core::Image& image) {
  double sum = 0;
  for (int row = 0; row < image.height / 2; ++row) {
    const double t0 = kPi * row / image.height, t1 = kPi * (row + 1) / image.height;
    const double projected = kPi * (std::cos(2 * t0) - std::cos(2 * t1)) / 2 / image.width;
    for (int column = 0; column < image.width; ++column)
      sum += projected * core::Luminance({image.at(0, row, column), image.at(1, row, column),
                                          image.at(2, row, column)});
  }
  return sum;
}

// The picture's sum over its pixels is the illuminance that is printed: the sky's to 0.5 %, the
// sun's moved by up to half a pixel.
TEST(CloudLayer, PictureHoldsThePrintedIlluminance) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const SunSky sky(SunAt(50, 200), 2.5, 0.2, Clouds(0.5, seed), kNoon);
    const core::Image image = sky.Picture(EnvironmentLayout::kLatitudeLongitude, 256);
    const double moved = 0.5 * kPi / 256 * std::cos(50 * kDegree);
    EXPECT_NEAR(Horizontal(image), core::Luminance(sky.global_horizontal()),
                moved * core::Luminance(sky.direct_normal()) +
                    5e-3 * core::Luminance(sky.diffuse_horizontal()))
        << seed;
    for (const float value : image.data) ASSERT_TRUE(value >= 0 && std::isfinite(value));
  }
}

// Clouds thinner and fewer than can be seen: the clear sky.
TEST(CloudLayer, FewAndThinLeavesTheClearSky) {
  CloudOptions options = Clouds(1e-6);
  const SunSky clear(SunAt(30), 3, 0.2), sky(SunAt(30), 3, 0.2, options, kNoon);
  EXPECT_NEAR(sky.diffuse_horizontal()[1] / clear.diffuse_horizontal()[1], 1, 1e-4);
  EXPECT_NEAR(sky.region_horizontal()[1] / clear.global_horizontal()[1], 1, 1e-4);
  EXPECT_NEAR(sky.direct_normal()[1] / clear.direct_normal()[1], 1, 1e-4);
}

TEST(CloudLayer, IsTheSameWithAnyNumberOfThreads) {
  const auto picture = [](int threads) {
    core::Image image;
    core::Rgb diffuse;
    core::OnThreads(threads, [&] {
      const SunSky sky(SunAt(40), 3, 0.2, Clouds(0.4, 9), kNoon);
      image = sky.Picture(EnvironmentLayout::kLatitudeLongitude, 64);
      diffuse = sky.diffuse_horizontal();
    });
    return std::pair{image.data, diffuse};
  };
  const auto one = picture(1), two = picture(2);
  EXPECT_EQ(one, two);
}

TEST(CloudLayer, RefusesWhatIsOutOfRange) {
  const auto make = [](auto change) {
    CloudOptions options = Clouds(0.5);
    change(options);
    CloudLayer layer(options, kNoon, {0, 0, 1});
  };
  EXPECT_THROW(make([](CloudOptions& o) { o.cover = 0; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.cover = 1.01; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.cover = NAN; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.altitude_m = 50; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.optical_thickness = 0; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.wind_m_s = -1; }), InputError);
  EXPECT_THROW(make([](CloudOptions& o) { o.wind_from_deg = NAN; }), InputError);
  EXPECT_NO_THROW(make([](CloudOptions& o) { o.cover = 1; }));
}

}  // namespace
}  // namespace luxfield::environment
