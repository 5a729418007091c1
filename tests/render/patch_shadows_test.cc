// Soft shadow maps of the filter plane's patches against quadrature of the lamp's light past edges
// of known place, and against cases with known answers.
#include "luxfield/render/lights/patch_shadows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/scene/device_scene.h"
#include "luxfield/scene/ray_caster.h"
#include "tests/render/brute_force.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;
using scene::Geometry;
using scene::Pose;

// 6 x 5 images, light within tangents of +-0.5 about each u.
lightfield::LightField Lamp() {
  return StructuredLuminaire("rings", {.grid_width = 6, .grid_height = 5}, 20140905);
}

// That maps of this lamp span: the image and the patches over delta, twice.
constexpr double kTangents = (0.3 + 2 * 8 * 0.0165 / 4) / 0.3;

// A lamp with what soft shadows need, in a scene.
struct Stage {
  Device device = Device::Open();
  lightfield::LightField field = Lamp();
  LuminaireOnDevice lamp{device, field};
  DeviceBvh bvh;

  explicit Stage(const Geometry& geometry)
      : bvh(UploadBvh(device, geometry, scene::BuildBvh(geometry))) {
    const auto patches = preprocess::TabulatePatchLight(field);
    lamp.Add(device, {.patches = &patches});
  }

  PatchShadows Shadows(int size = 256, const Pose& pose = {}) const {
    return {device, lamp, pose, bvh, size};
  }
  std::vector<float> Shares(const std::vector<SurfacePoint>& points, int size = 256,
                            const Pose& pose = {}) const {
    return Shadows(size, pose).Shares(MakeGBuffer(device, points)).Download<float>();
  }
};

// Of the irradiance at a receiver what comes from the points (u, v) of F that `seen` is true of.
double VisibleShare(const lightfield::LightField& field, const SurfacePoint& point,
                    const std::function<bool(double, double)>& seen) {
  double visible = 0, all = 0;
  VisitLight(field, point.p, 1, [&](double flux, Vec3 to_lamp) {
    const double light = flux * std::max(0.0, Dot(point.n, to_lamp));
    all += light;
    if (seen(point.p.x + to_lamp.x, point.p.y + to_lamp.y)) visible += light;
  });
  return all > 0 ? visible / all : 0;
}

// Receivers that the lamp's light reaches, from 0.4 to 4 m before F, turned towards it.
std::vector<SurfacePoint> FacingReceivers(int count, std::uint64_t seed) {
  core::Random random(seed, 1);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < count; ++k) {
    const double z = 0.4 * std::pow(10.0, random.Uniform());
    points.push_back(
        RoundToFloat({{0.4 * z * (random.Uniform() - 0.5), 0.3 * z * (random.Uniform() - 0.5), z},
                      Normalized(Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5, -1})}));
  }
  return points;
}

TEST(PatchShadows, BlockersThatHideAllOrNone) {
  const std::uint64_t seed = TestSeed(1);
  const auto points = FacingReceivers(200, seed);
  const auto wall = [](double x0, double x1) {
    Geometry geometry;
    AppendQuad({x0, -5, 0.2}, {x1 - x0, 0, 0}, {0, 10, 0}, 0, geometry);
    return geometry;
  };
  EXPECT_THAT(Stage(wall(-5, 5)).Shares(points), testing::Each(0.0f));
  EXPECT_THAT(Stage(wall(6, 9)).Shares(points), testing::Each(1.0f));
  EXPECT_THAT(Stage(Geometry()).Shares(points), testing::Each(1.0f));
  // Behind the lamp, outside its light, and turned away.
  EXPECT_THAT(
      Stage(Geometry())
          .Shares({{{0, 0, -1}, {0, 0, 1}}, {{9, 0, 1}, {-1, 0, 0}}, {{0, 0, 1}, {0, 0, 1}}}),
      testing::Each(0.0f));
}

// Where the profile of shares falls through `level`, by linear interpolation.
double CrossingOf(const std::vector<double>& shares, double level, double step) {
  for (std::size_t k = 1; k < shares.size(); ++k)
    if (shares[k - 1] >= level && shares[k] < level)
      return step *
             (static_cast<double>(k - 1) + (shares[k - 1] - level) / (shares[k - 1] - shares[k]));
  return NAN;
}

TEST(PatchShadows, PenumbraeAreAsWideAsTheLampMakesThem) {
  // An edge parallel to v, to u, and askew: d.(x, y) > 0 is hidden where light passes z_edge.
  for (const Vec3 across : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Normalized(Vec3{1, 0.6, 0})}) {
    const double z_edge = 0.5, z = 1.2, step = 0.006;
    const Vec3 along{-across.y, across.x, 0};
    Geometry geometry;
    AppendQuad(Vec3{0, 0, z_edge} + -5.0 * along, 10.0 * along, 5.0 * across, 0, geometry);
    const Stage stage(geometry);
    std::vector<SurfacePoint> points;
    for (int k = -40; k <= 40; ++k)
      points.push_back(RoundToFloat({(k * step) * across + Vec3{0, 0, z}, {0, 0, -1}}));
    const auto shares = stage.Shares(points, 256);
    std::vector<double> ours, truth;
    double square = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3 p = points[k].p;
      ours.push_back(shares[k]);
      truth.push_back(VisibleShare(stage.field, points[k], [&](double u, double v) {
        const Vec3 at = Vec3{u, v, 0} + (z_edge / z) * (p - Vec3{u, v, 0});
        return Dot(across, at) < 0;
      }));
      square += std::pow(ours.back() - truth.back(), 2);
    }
    const double rms = std::sqrt(square / static_cast<double>(points.size()));
    const double width = CrossingOf(ours, 0.1, step) - CrossingOf(ours, 0.9, step),
                 true_width = CrossingOf(truth, 0.1, step) - CrossingOf(truth, 0.9, step);
    std::printf("across (%.2f, %.2f): rms %.4f, width %.1f mm, of the truth %.1f mm\n", across.x,
                across.y, rms, 1e3 * width, 1e3 * true_width);
    // Sixteen steps of a sixteenth have an rms of 1/56 in the penumbra; light is uneven, and the
    // steps of edges askew are.
    EXPECT_LT(rms, 0.035);
    EXPECT_NEAR(width, true_width, 0.2 * true_width);
    EXPECT_NEAR(CrossingOf(ours, 0.5, step), CrossingOf(truth, 0.5, step), 0.1 * true_width);
  }
}

// A board stands on a floor: behind its foot the shadow's edge is sharper than the maps, and they
// look along the floor.
TEST(PatchShadows, AtTheFootOfABoardSharesAreNearTheTruth) {
  const std::uint64_t seed = TestSeed(8);
  core::Random random(seed, 8);
  Geometry geometry;
  AppendQuad({-5, -0.3, 0.5}, {0, 0, 9}, {10, 0, 0}, 0, geometry);
  AppendQuad({-0.4, -0.3, 3}, {0.4, 0, 0}, {0, 0.5, 0}, 0, geometry);
  const Stage stage(geometry);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 2000; ++k) {
    const double behind = 0.05 + 0.5 * random.Uniform();
    points.push_back(
        RoundToFloat({{0.04 * behind * (2 * random.Uniform() - 1), -0.3, 3 + behind}, {0, 1, 0}}));
  }
  const auto shares = stage.Shares(points, 384);
  double square = 0, mean = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3 p = points[k].p;
    const double truth = VisibleShare(stage.field, points[k], [&](double u, double v) {
      const Vec3 at = p + ((p.z - 3) / p.z) * (Vec3{u, v, 0} - p);
      return !(at.x > -0.4 && at.x < 0 && at.y < 0.2);
    });
    square += std::pow(shares[k] - truth, 2) / static_cast<double>(points.size());
    mean += (shares[k] - truth) / static_cast<double>(points.size());
  }
  std::printf("rms %.4f, bias %+.4f\n", std::sqrt(square), mean);
  // Four of sixteen patches that lie in different rows and columns tell the part of the lamp beside an
  // edge to 1/8 at worst, 1/14 in the mean square; rays to patches of one column are off by 0.24.
  EXPECT_LT(std::sqrt(square), 0.13);
  EXPECT_LT(std::abs(mean), 0.05);
}

TEST(PatchShadows, NoPlaneShadesItself) {
  const std::uint64_t seed = TestSeed(3);
  core::Random random(seed, 3);
  for (const int size : {16, 64, 256})
    for (const double slope : {0.001, 0.03, 0.3, 1.0, 5.0})
      for (const double offset : {0.0, 2000.0}) {
        // A plane through (0, -0.2, 1) that rises by `slope` along z, the lamp above it.
        const Pose pose = scene::Translation({offset, 0, -offset});
        Geometry geometry;
        const Vec3 at = pose.Point({0, -0.2, 1}), along{0, slope, 1};
        AppendQuad(at + -50.0 * along + Vec3{-50, 0, 0}, {100, 0, 0}, 100.0 * along, 0, geometry);
        const Vec3 n = Normalized(Vec3{0, 1, -slope});
        std::vector<SurfacePoint> points;
        for (int k = 0; k < 300; ++k)
          points.push_back(RoundToFloat(
              {at + (random.Uniform() - 0.5) * Vec3{1, 0, 0} + (4 * random.Uniform() - 0.5) * along,
               n}));
        const Stage stage(geometry);
        const auto together = stage.Shares(points, size, pose);
        int lit = 0;
        for (std::size_t k = 0; k < points.size(); ++k) {
          const auto [p, normal] = points[k];
          const Vec3 local = p - pose.translation;
          // Where the horizon passes the lamp's points, rays graze the plane.
          if (Dot(normal, local) > -0.02 || local.z <= 0) continue;
          if (together[k] == 0) continue;  // no light arrives
          ++lit;
          EXPECT_EQ(together[k], 1) << "seed " << seed << ", size " << size << ", slope " << slope
                                    << ", offset " << offset << ", point " << k;
        }
        if (slope < 1) {
          EXPECT_GT(lit, 100);
        }
      }
}

TEST(PatchShadows, AClosedBoxStaysDark) {
  const std::uint64_t seed = TestSeed(4);
  core::Random random(seed, 4);
  // On a floor, walls without thickness, all receivers inside on floor and walls, corners included.
  const Pose pose = scene::LookAt({0, -2, 1}, {0, 0, 0.2}, {0, 0, 1});
  Geometry geometry;
  AppendQuad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0, geometry);
  AppendBox(scene::Translation({0, 0, 0.2}) * scene::RotationXyz({0, 0, 25}) *
                scene::Scaling({0.6, 0.5, 0.4}),
            0, geometry);
  const Pose box = scene::Translation({0, 0, 0.2}) * scene::RotationXyz({0, 0, 25});
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 4000; ++k) {
    // Half of them within millimetres of an edge of the floor.
    const double x = random.Uniform() - 0.5, y = random.Uniform() - 0.5,
                 near = k % 2 ? 0.5 - 0.01 * random.Uniform() : std::abs(y);
    const double side = random.Uniform() < 0.5 ? -1 : 1;
    if (k % 4 < 2)
      points.push_back(RoundToFloat({box.Point({0.6 * x, 0.5 * side * near, -0.2}), {0, 0, 1}}));
    else
      points.push_back(RoundToFloat({box.Point({0.6 * side * near, 0.5 * y, -0.2}), {0, 0, 1}}));
  }
  const Stage stage(geometry);
  for (const int size : {64, 256}) {
    const auto shares = stage.Shares(points, size, pose);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3 p = box.Inverse().Point(points[k].p);
      // All four texels may miss a corner that sticks out by less than half their width: some
      // patches of sixteen are then seen past it.
      const double half = 0.5 * kTangents / size * Length(points[k].p - pose.translation);
      const bool corner = std::abs(p.x) > 0.3 - half && std::abs(p.y) > 0.25 - half;
      EXPECT_LE(shares[k], corner ? 0.3 : 0) << "seed " << seed << ", size " << size
                                             << ", in the box at (" << p.x << ", " << p.y << ")";
    }
  }
}

TEST(PatchShadows, TilesAnswerAsTheirPixelsDo) {
  const std::uint64_t seed = TestSeed(5);
  Geometry geometry;
  AppendQuad({-3, -0.3, 0}, {6, 0, 0}, {0, 0, 6}, 0, geometry);
  for (int k = -3; k <= 3; ++k)
    AppendQuad({0.06 * k, -0.3, 0.6}, {0.02, 0, 0}, {0, 2, 0}, 0, geometry);
  const Stage stage(geometry);
  const PatchShadows shadows = stage.Shadows();
  // A floor seen in rows of 8, so that tiles of 8 x 8 lie in one plane.
  constexpr int kSide = 64;
  std::vector<SurfacePoint> points;
  core::Random random(seed, 5);
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      points.push_back(RoundToFloat(
          {{0.01 * (column - kSide / 2) + 0.002 * random.Uniform(), -0.3, 0.8 + 0.02 * row},
           {0, 1, 0}}));
  GBuffer picture = MakeGBuffer(stage.device, points);
  picture.width = picture.height = kSide;
  const auto tiled = shadows.Shares(picture).Download<float>();
  int half = 0;
  for (std::size_t k = 0; k < points.size(); k += 7) {
    const auto alone = shadows.Shares(MakeGBuffer(stage.device, {points[k]})).Download<float>();
    EXPECT_NEAR(alone[0], tiled[k], 1e-5) << "seed " << seed << ", point " << k;
    half += tiled[k] > 0.05f && tiled[k] < 0.95f;
  }
  EXPECT_GT(half, 30);
}

TEST(PatchShadows, MapsThatAreDrawnAnewAreThoseOfTheNewPlace) {
  const std::uint64_t seed = TestSeed(6);
  Geometry geometry;
  for (int k = -3; k <= 3; ++k)
    AppendQuad({0.06 * k, -1, 0.3}, {0.02, 0, 0}, {0, 2, 0}, 0, geometry);
  const Stage stage(geometry);
  const auto points = FacingReceivers(300, seed);
  const GBuffer gbuffer = MakeGBuffer(stage.device, points);
  const Pose there = scene::Translation({0.013, 0.02, -0.1});
  PatchShadows moved = stage.Shadows();
  const auto before = moved.Shares(gbuffer).Download<float>();
  moved.Draw(there, stage.bvh);
  const auto after = moved.Shares(gbuffer).Download<float>();
  EXPECT_EQ(after, stage.Shares(points, 256, there));
  EXPECT_NE(after, before);
}

TEST(PatchShadows, VolumeShowsTheShareOfItsLight) {
  const std::uint64_t seed = TestSeed(7);
  Geometry geometry;
  for (int k = -3; k <= 3; ++k)
    AppendQuad({0.06 * k, -1, 0.3}, {0.03, 0, 0}, {0, 2, 0}, 0, geometry);
  Stage stage(geometry);
  std::vector<SurfacePoint> points = FacingReceivers(400, seed);
  for (std::size_t k = 0; k < points.size(); k += 5)  // horizons that cut the lamp
    points[k] =
        RoundToFloat({points[k].p, Normalized(Cross(Normalized(points[k].p), Vec3{0, 1, 0}))});
  std::vector<preprocess::Receiver> receivers;
  for (const auto& [p, n] : points) receivers.push_back({p, n});
  const auto volume = preprocess::BuildForReceivers(stage.field, receivers).volume;
  stage.lamp.Add(stage.device, {.volume = &volume});
  const GBuffer gbuffer = MakeGBuffer(stage.device, points);
  const PatchShadows shadows = stage.Shadows();
  const auto shares = shadows.Shares(gbuffer).Download<float>();
  const auto estimator = MakeEstimator("volume", stage.device);
  const auto all = LightGBuffer(stage.device, *estimator, gbuffer, stage.lamp).irradiance;
  Lighting lighting(stage.device, gbuffer);
  estimator->Light({gbuffer, {.patches = &shadows}}, PosedLuminaire{stage.lamp}, {}, lighting);
  const auto lit = lighting.irradiance.Download<cl_float4>();
  int partly = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(lit[k].s[0], shares[k] * all[k].s[0], 1e-6 * all[k].s[0]) << k;
    partly += shares[k] > 0 && shares[k] < 1 && all[k].s[0] > 0;
  }
  EXPECT_GT(partly, 50);
}

TEST(PatchShadows, RefuseWhatMakesNoSense) {
  const Stage stage{Geometry()};
  for (const int size : {-1, 0, 4112}) EXPECT_THROW(stage.Shadows(size), InputError) << size;
  EXPECT_EQ(stage.Shadows(100).size(), 112);
  const auto exact = MakeEstimator("exact", stage.device);
  const PatchShadows shadows = stage.Shadows();
  const GBuffer gbuffer = MakeGBuffer(stage.device, {{{0, 0, 1}, {0, 0, -1}}});
  Lighting lighting(stage.device, gbuffer);
  try {
    exact->Light({gbuffer, {.patches = &shadows}}, PosedLuminaire{stage.lamp}, {}, lighting);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("'exact' takes no shadows from soft shadow maps"));
    EXPECT_THAT(error.what(), testing::HasSubstr("volume"));
  }
}

}  // namespace
}  // namespace luxfield::render
