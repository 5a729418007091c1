// `volume` on the OpenCL device against lightfield's closed form, and `exact` where it hands over.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/estimators/volume.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::LightField;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = 72;

// Receivers facing the lamp more or less, 0.35 to 6 m in front of F, most of them lit.
std::vector<SurfacePoint> Receivers(std::size_t count) {
  core::Random random(kSeed, 3);
  std::vector<SurfacePoint> points(count);
  for (auto& point : points) {
    const double z = 0.6 * std::pow(10.0, random.Uniform());
    const Vec3 p{0.4 * z * (random.Uniform() - 0.5), 0.4 * z * (random.Uniform() - 0.5), z};
    const Vec3 n{random.Uniform() - 0.5, random.Uniform() - 0.5, -0.6};
    point = RoundToFloat({p, Normalized(n)});
  }
  return points;
}

std::vector<preprocess::Receiver> AsReceivers(const std::vector<SurfacePoint>& points) {
  std::vector<preprocess::Receiver> receivers;
  receivers.reserve(points.size());
  for (const auto& [p, n] : points) receivers.push_back({p, n});
  return receivers;
}

double RelativeRmse(const LightField& field, const std::vector<SurfacePoint>& points,
                    const Lit& lit) {
  double squares = 0, sum = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto judge = lightfield::ExactIrradiance(field, points[k].p, points[k].n);
    for (int channel = 0; channel < 3; ++channel) {
      const double value = lit.irradiance[k].s[channel];
      squares += std::pow(value - judge[channel], 2);
      sum += judge[channel];
    }
  }
  return std::sqrt(squares * static_cast<double>(3 * points.size())) / sum;
}

TEST(Volume, HasTheErrorItWasBuiltFor) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device);
  const auto points = Receivers(1000);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const char* kind : {"facets", "filament", "noise"})
    for (const int channels : {1, 3}) {
      LuminaireShape shape;
      shape.channels = channels;
      const auto field = StructuredLuminaire(kind, shape, kSeed);
      const auto built =
          preprocess::BuildForReceivers(field, AsReceivers(points), {.max_rel_error = 1e-3}, 1000);
      ASSERT_TRUE(built.met);
      const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
      const Lit lit = LightGBuffer(device, *volume, gbuffer, luminaire);
      const double error = RelativeRmse(field, points, lit);
      std::printf("%s, %d channels: %d x %d x %d nodes, relative RMSE %.2e, stated %.2e\n", kind,
                  channels, built.volume.a_x.nodes, built.volume.a_y.nodes, built.volume.tau.nodes,
                  error, built.rel_error);
      // The same receivers in float32 and, on a few, by `exact`.
      EXPECT_LT(error, 1.02 * built.rel_error + 1e-5);
      EXPECT_GT(error, 0.9 * built.rel_error);
      // The kernel against the same spline in double: float32 rounds positions in the table to some
      // 1e-5 of a node, and sums.
      double worst = 0;
      int interpolated = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const auto [p, n] = points[k];
        const auto vector = preprocess::InterpolateLightVector(built.volume, p);
        if (!vector || !preprocess::VolumeLights(field.geometry, {p, n}, 10)) continue;
        if (Length(vector->j[0]) == 0) continue;
        ++interpolated;
        for (int channel = 0; channel < 3; ++channel)
          worst =
              std::max(worst, std::abs(lit.irradiance[k].s[channel] - Dot(n, vector->j[channel])) /
                                  Length(vector->j[channel]));
      }
      EXPECT_GT(interpolated, 800);
      EXPECT_LT(worst, 2e-4);
    }
}

// Rows of a picture of a plane, or of a surface whose normal turns; `across` receivers from end to end.
std::vector<SurfacePoint> Rows(int across, bool curved) {
  std::vector<SurfacePoint> points;
  for (int y = 0; y < 3000 / across; ++y)
    for (int k = 0; k < across; ++k) {
      const double x = k / (across - 1.0) - 0.5;
      points.push_back(
          RoundToFloat({{0.3 * x, 0.04 * (y % 3) - 0.05, 0.9 + (curved ? 0.1 * x * x : 0)},
                        Normalized(Vec3{0.1 + (curved ? 0.3 * x : 0), -0.2, -1})}));
    }
  return points;
}

// Along a row of a picture neighbours lie in one cell of the table or in some side by side, and read its
// coefficients together, those of a plane their product with the normal; in any other order many read their
// own. Up to rounding that is the same.
TEST(Volume, NeighboursOfACellAreLitAsOthers) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device);
  core::Random random(kSeed, 6);
  for (const int channels : {1, 3})
    for (const bool curved : {false, true})
      for (const int across :
           {1000, 200, 50, 15}) {  // a third of a cell, to several, to 16 receivers
        const std::vector<SurfacePoint> row = Rows(across, curved);
        std::vector<std::size_t> order(row.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::shuffle(order.begin(), order.end(), random);
        std::vector<SurfacePoint> shuffled;
        shuffled.reserve(row.size());
        for (const std::size_t k : order) shuffled.push_back(row[k]);
        const auto field = StructuredLuminaire("facets", {.channels = channels}, kSeed);
        const auto built =
            preprocess::BuildForReceivers(field, AsReceivers(row), {.max_rel_error = 1e-3}, 500);
        const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
        const Lit together = LightGBuffer(device, *volume, MakeGBuffer(device, row), luminaire),
                  apart = LightGBuffer(device, *volume, MakeGBuffer(device, shuffled), luminaire);
        double worst = 0, brightest = 0;
        for (std::size_t k = 0; k < row.size(); ++k)
          for (int channel = 0; channel < 3; ++channel) {
            const float one = together.irradiance[order[k]].s[channel],
                        other = apart.irradiance[k].s[channel];
            worst = std::max<double>(worst, std::abs(one - other));
            brightest = std::max<double>(brightest, other);
          }
        std::printf("%d channels, %s, %d across %d nodes: %.1e of the brightest apart\n", channels,
                    curved ? "curved" : "plane", across, built.volume.a_x.nodes, worst / brightest);
        EXPECT_LT(worst, 2e-6 * brightest);
        EXPECT_LT(RelativeRmse(field, row, together), 1.1e-3);
        EXPECT_LT(RelativeRmse(field, shuffled, apart), 1.1e-3);
      }
}

// Out of reach, cut horizons, near and between the planes: `exact`, never extrapolated; behind and
// beside the light: nothing.
TEST(Volume, HandsOverToExactAndExtrapolatesNothing) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device), exact = MakeEstimator("exact", device);
  const auto field = StructuredLuminaire("rings", {.channels = 3}, kSeed);
  const std::vector<preprocess::Receiver> few{{{-0.05, -0.05, 1}, {0, 0, -1}},
                                              {{0.05, 0.05, 1.5}, {0, 0, -1}}};
  const auto built = preprocess::BuildForReceivers(field, few);
  ASSERT_GT(built.volume.bytes(), 0u);
  const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
  std::vector<SurfacePoint> points;
  for (const double z : {0.01, 0.2, 0.3, 0.31, 0.9, 1.6, 10.0, 1e3, 1e6})
    points.push_back(RoundToFloat({{0.01 * z, 0.013 * z, z}, {0, 0, -1}}));
  for (const double x : {-0.4, -0.2, 0.2, 0.4})
    points.push_back(RoundToFloat({{x, 0.01, 1.2}, {0, 0, -1}}));
  core::Random random(kSeed, 4);
  for (int k = 0; k < 100; ++k) {  // horizons through the lamp, inside the reach
    const Vec3 p{0.05 * (random.Uniform() - 0.5), 0.05 * (random.Uniform() - 0.5), 1.2};
    const Vec3 u{0.02 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5), 0};
    const double angle = 2 * std::numbers::pi * random.Uniform();
    const Vec3 across =
        Normalized(Cross(Normalized(p - u), {std::cos(angle), std::sin(angle), 0.1}));
    points.push_back(RoundToFloat({p, across}));
  }
  const std::size_t lit_end = points.size();
  points.push_back({{0, 0, -1}, {0, 0, 1}});
  points.push_back({{0, 0, 0}, {0, 0, -1}});
  points.push_back({{90, 0, 1}, {0, 0, -1}});
  points.push_back({{0, 0, 1.2f}, {0, 0, 1}});
  const GBuffer gbuffer = MakeGBuffer(device, points);
  // What half of the error asked for allows is left unclipped: texels are 10 mm wide on F, and
  // cut ones darker by at most sqrt(2) / 8 10 mm / z = 1.5e-3 |J|.
  EstimatorOptions coarse;
  coarse.max_error = 1e-2f;
  const Lit lit = LightGBuffer(device, *volume, gbuffer, luminaire),
            unclipped = LightGBuffer(device, *volume, gbuffer, luminaire, coarse),
            judge = LightGBuffer(device, *exact, gbuffer, luminaire);
  int bright = 0;
  double worst_cut = 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int channel = 0; channel < 3; ++channel) {
      const float value = lit.irradiance[k].s[channel], expected = judge.irradiance[k].s[channel];
      bright += expected > 0;
      // `exact` sums neighbours together, up to rounding.
      EXPECT_NEAR(value, expected, 1e-5 * expected) << "point " << k;
      const bool cut = lightfield::HorizonCutsSupport(field.geometry, points[k].p, points[k].n);
      const double size = Length(lightfield::ClosedFormLightVector(field, points[k].p).j[channel]);
      const double darker = expected - unclipped.irradiance[k].s[channel];
      if (cut && size > 0) worst_cut = std::max(worst_cut, darker / size);
      EXPECT_NEAR(darker, 0, 1e-5 * expected + (cut ? 0.5e-2 * size : 0)) << "point " << k;
      if (k >= lit_end) {
        EXPECT_EQ(value, 0) << "point " << k;
      }
    }
  std::printf("cut horizons: at most %.1e |J| too dark\n", worst_cut);
  EXPECT_GT(worst_cut, 2e-5);  // or nothing was left unclipped
  EXPECT_LT(worst_cut, 1.5e-3);
  EXPECT_GT(bright, 250);
}

// Texels as large as the image: whatever decides by whole texels loses their light where a horizon
// cuts. The error that is stated holds over all receivers, against the closed form in double.
TEST(Volume, KeepsItsErrorWhereHorizonsCutCoarseTexels) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device);
  LuminaireShape shape;
  shape.grid_width = shape.grid_height = 4;
  shape.width = shape.height = 1;
  shape.image_m = 0.9;
  shape.spacing_m = 0.05;
  const auto field = StructuredLuminaire("noise", shape, kSeed);
  core::Random random(kSeed, 5);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 300; ++k) {  // from just before F to 10 m, every second horizon cuts
    const double z = 1e-3 * std::pow(1e4, random.Uniform());
    const Vec3 p{0.5 * z * (random.Uniform() - 0.5), 0.5 * z * (random.Uniform() - 0.5), z};
    const Vec3 u{0.2 * (random.Uniform() - 0.5), 0.2 * (random.Uniform() - 0.5), 0};
    const double angle = 2 * std::numbers::pi * random.Uniform();
    points.push_back(RoundToFloat(
        {p, k % 2 ? Normalized(Cross(p - u, {std::cos(angle), std::sin(angle), 0.3}))
                  : Normalized(Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5, -0.6})}));
  }
  const auto built = preprocess::BuildForReceivers(field, AsReceivers(points));
  ASSERT_TRUE(built.met);
  ASSERT_GT(built.volume.bytes(), 0u);
  const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
  const Lit lit = LightGBuffer(device, *volume, MakeGBuffer(device, points), luminaire);
  const double error = RelativeRmse(field, points, lit);
  int cut = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto [p, n] = points[k];
    const double truth = lightfield::ExactIrradiance(field, p, n)[0],
                 size = Length(lightfield::ClosedFormLightVector(field, p).j[0]);
    cut += truth > 0 && lightfield::HorizonCutsSupport(field.geometry, p, n);
    EXPECT_NEAR(lit.irradiance[k].s[0], truth, 3e-5 * size) << "point " << k;
  }
  std::printf("one texel: relative RMSE %.2e, stated %.2e, %d horizons cut, seed %d\n", error,
              built.rel_error, cut, static_cast<int>(kSeed));
  EXPECT_GT(cut, 100);
  EXPECT_LT(error, built.rel_error + 1e-5);
}

TEST(Volume, WithoutNodesItIsExact) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device), exact = MakeEstimator("exact", device);
  const auto field = StructuredLuminaire("facets", {}, kSeed);
  const auto built = preprocess::BuildForReceivers(field, {});
  const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
  const auto points = Receivers(50);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const Lit lit = LightGBuffer(device, *volume, gbuffer, luminaire),
            judge = LightGBuffer(device, *exact, gbuffer, luminaire);
  for (std::size_t k = 0; k < points.size(); ++k)
    EXPECT_NEAR(lit.irradiance[k].s[0], judge.irradiance[k].s[0], 1e-5f * judge.irradiance[k].s[0]);
}

// As a check of the frames: the volume is in the luminaire's, the receivers in the world's.
TEST(Volume, LightsFromAPose) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device);
  const auto field = StructuredLuminaire("facets", {.channels = 3}, kSeed);
  const auto points = Receivers(1000);
  const auto built =
      preprocess::BuildForReceivers(field, AsReceivers(points), {.max_rel_error = 5e-3}, 300);
  const LuminaireOnDevice luminaire(device, field, {.volume = &built.volume});
  const scene::Pose pose = scene::Translation({3, -2, 5}) * scene::RotationXyz({20, -35, 50});
  std::vector<SurfacePoint> world;
  world.reserve(points.size());
  for (const auto& [p, n] : points)
    world.push_back(RoundToFloat({pose.Point(p), Normalized(pose.Vector(n))}));
  const Lit lit =
      LightGBuffer(device, *volume, MakeGBuffer(device, world), luminaire, {}, nullptr, pose);
  EXPECT_LT(RelativeRmse(field, points, lit), 5e-3);
}

// The same share of the same rays, seed by seed, times an irradiance that is nearly the same.
TEST(Volume, ShadowsAreThoseOfExact) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device), exact = MakeEstimator("exact", device);
  const auto field = StructuredLuminaire("rings", {}, kSeed);
  const auto points = Receivers(200);
  const auto cells = preprocess::BuildCellTables(field, "test");
  const auto built = preprocess::BuildForReceivers(field, AsReceivers(points));
  const LuminaireOnDevice luminaire(device, field, {.cells = &cells, .volume = &built.volume});
  const auto half = Blocker(device, 0, 10, 1e-4f);  // over half of the lamp
  const GBuffer gbuffer = MakeGBuffer(device, points);
  EstimatorOptions options;
  options.samples_per_pixel = 16;
  const Lit lit = LightGBuffer(device, *volume, gbuffer, luminaire, options, half.get()),
            judge = LightGBuffer(device, *exact, gbuffer, luminaire, options, half.get()),
            open = LightGBuffer(device, *exact, gbuffer, luminaire, options);
  double sum = 0, squares = 0;
  int shadowed = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    sum += judge.irradiance[k].s[0];
    squares += std::pow(lit.irradiance[k].s[0] - judge.irradiance[k].s[0], 2);
    shadowed += judge.irradiance[k].s[0] < 0.9f * open.irradiance[k].s[0];
    EXPECT_NEAR(lit.variance[k], judge.variance[k], 0.05 * judge.variance[k] + 1e-12);
    EXPECT_EQ(lit.samples[k], judge.samples[k]);
  }
  EXPECT_GT(shadowed, 100);
  EXPECT_LT(std::sqrt(squares * static_cast<double>(points.size())) / sum, 3 * built.rel_error);
}

// Horizons through the lamp too: what a share of rays lights is lit once, so that its variance, which
// grows with the square of the light, is that of `exact`; a lamp of both signs, whose rays' own light
// enters besides.
TEST(Volume, ShadowsOfCutHorizonsAreThoseOfExact) {
  const Device device = Device::Open();
  const auto volume = MakeEstimator("volume", device), exact = MakeEstimator("exact", device);
  auto field = StructuredLuminaire("rings", {}, kSeed);
  for (std::size_t k = 0; k < field.data.size(); k += 7) field.data[k] *= -0.1f;
  core::Random random(kSeed, 7);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 200; ++k) {
    const Vec3 p{0.05 * (random.Uniform() - 0.5), 0.05 * (random.Uniform() - 0.5), 1.2};
    const Vec3 u{0.02 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5), 0};
    const double angle = 2 * std::numbers::pi * random.Uniform();
    points.push_back(RoundToFloat(
        {p, Normalized(Cross(Normalized(p - u), {std::cos(angle), std::sin(angle), 0.1}))}));
  }
  const auto cells = preprocess::BuildCellTables(field, "test");
  const std::vector<preprocess::Receiver> few{{{-0.05, -0.05, 1}, {0, 0, -1}},
                                              {{0.05, 0.05, 1.5}, {0, 0, -1}}};
  const auto built = preprocess::BuildForReceivers(field, few);
  const LuminaireOnDevice luminaire(device, field, {.cells = &cells, .volume = &built.volume});
  const auto half = Blocker(device, 0, 10, 1e-4f);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  EstimatorOptions options;
  options.samples_per_pixel = 16;
  options.max_error = 1e-2f;  // as above, no texel is clipped
  const Lit lit = LightGBuffer(device, *volume, gbuffer, luminaire, options, half.get()),
            judge = LightGBuffer(device, *exact, gbuffer, luminaire, options, half.get());
  int noisy = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double size = Length(lightfield::ClosedFormLightVector(field, points[k].p).j[0]);
    EXPECT_NEAR(lit.irradiance[k].s[0], judge.irradiance[k].s[0], 0.01 * size) << k;
    if (judge.irradiance[k].s[0] < 0.01 * size || judge.variance[k] == 0) continue;
    ++noisy;
    EXPECT_NEAR(lit.variance[k] / judge.variance[k], 1, 0.2) << k;
  }
  EXPECT_GT(noisy, 10);
}

TEST(Volume, IsRefusedWhereThereIsNone) {
  const Device device = Device::Open();
  const LuminaireOnDevice luminaire(device, StructuredLuminaire("facets", {}, kSeed));
  const GBuffer gbuffer = MakeGBuffer(device, Receivers(3));
  EXPECT_THROW(LightGBuffer(device, *MakeEstimator("volume", device), gbuffer, luminaire),
               InputError);
}

}  // namespace
}  // namespace luxfield::render
