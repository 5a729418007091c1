// Shadow maps against ray casts on the CPU and against cases with known answers.
#include "luxfield/render/lights/shadow_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/scene/device_scene.h"
#include "luxfield/scene/ray_caster.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::Vec2;
using lightfield::Vec3;
using scene::Geometry;
using scene::Pose;

constexpr std::uint64_t kSeed = 20140905;
constexpr double kLift = 0.78, kReach = 1.5;  // in texel widths, as shadow_maps.h states

// 3 x 2 images, n = 3: 5 x 4 cells of 16.5 mm; light within tangents of +-0.5 about each u.
lightfield::LightField Lamp() { return StructuredLuminaire("facets", {}, kSeed); }

// seen[point][cell].
std::vector<std::vector<bool>> Seen(const ShadowMaps& maps, const Device& device, int cells,
                                    const std::vector<SurfacePoint>& points) {
  const auto words = maps.SeeCells(MakeGBuffer(device, points)).Download<cl_uint>();
  const std::size_t stride = (cells + 31) / 32;
  std::vector<std::vector<bool>> seen(points.size(), std::vector<bool>(cells));
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int cell = 0; cell < cells; ++cell)
      seen[k][cell] = (words[k * stride + cell / 32] >> (cell % 32)) & 1;
  return seen;
}

// The texel's width per metre in front of a light, for lights on F.
double TexelTangent(const lightfield::LuminaireGeometry& g, int size) {
  // 2 (n - 1/2) spacings wider than the image, and borders.
  return 1.06 * (g.lattice.extent_s_m() + 5 * g.grid.spacing_m) / g.delta_m / size;
}

Vec3 RandomDirection(core::Random& random) {
  while (true) {
    const Vec3 d{2 * random.Uniform() - 1, 2 * random.Uniform() - 1, 2 * random.Uniform() - 1};
    if (Length(d) > 0.1 && Length(d) < 1) return Normalized(d);
  }
}

bool Blocked(const scene::RayCaster& rays, Vec3 from, Vec3 light) {
  return rays.Occluded({from, light - from, 0, 1});
}

// Receivers that the lamp's light reaches, from 0.4 to 4 m before F, turned towards it.
std::vector<SurfacePoint> FacingReceivers(int count) {
  core::Random random(kSeed, 1);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < count; ++k) {
    const double z = 0.4 * std::pow(10.0, random.Uniform());
    points.push_back(
        RoundToFloat({{0.8 * z * (random.Uniform() - 0.5), 0.6 * z * (random.Uniform() - 0.5), z},
                      Normalized(Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5, -1})}));
  }
  return points;
}

TEST(ShadowMaps, BlockersThatHideAllNoneOrHalf) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto lights = CellCentres(lamp);
  ASSERT_EQ(lights.size(), 20u);
  const auto points = FacingReceivers(200);
  const double z_blocker = 0.2;
  const auto wall = [&](double x0, double x1) {
    Geometry geometry;
    AppendQuad({x0, -5, z_blocker}, {x1 - x0, 0, 0}, {0, 10, 0}, 0, geometry);
    return ShadowMaps(device, lamp.geometry, lights, {}, *MakeRayScene(device, geometry));
  };
  for (const auto& seen : Seen(wall(-5, 5), device, 20, points))
    EXPECT_THAT(seen, testing::Each(false));
  for (const auto& seen : Seen(wall(6, 9), device, 20, points))
    EXPECT_THAT(seen, testing::Each(true));

  const auto seen = Seen(wall(0, 5), device, 20, points);
  int judged = 0, near_edge = 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    for (std::size_t cell = 0; cell < lights.size(); ++cell) {
      const Vec3 p = points[k].p, light = lights[cell].position;
      const double x = light.x + (p.x - light.x) * z_blocker / p.z;
      // Where p may be moved to by the texel and the lift, seen at the blocker.
      const double doubt =
          1.001 * kReach * TexelTangent(lamp.geometry, 192) * p.z * z_blocker / p.z;
      if (std::abs(x) < doubt) {
        ++near_edge;
        continue;
      }
      ++judged;
      EXPECT_EQ(seen[k][cell], x < 0) << "point " << k << ", cell " << cell;
    }
  EXPECT_GT(judged, 10 * near_edge);
}

TEST(ShadowMaps, ARandomSceneAgreesWithRaysUpToTheStatedFootprint) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto tables = preprocess::BuildTables(lamp, "test.lf.exr", std::string(64, '0'));
  const Pose pose = scene::LookAt({3, -2, 1.5}, {1, 2, 0}, {0, 0, 1});
  Geometry geometry;
  AppendQuad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 0, geometry);
  core::Random random(kSeed, 2);
  for (int k = 0; k < 14; ++k) {
    const double z = 0.4 + 3.5 * random.Uniform();
    const Vec3 at{0.8 * z * (random.Uniform() - 0.5), 0.6 * z * (random.Uniform() - 0.5), z};
    const auto size = [&] { return 0.03 * z + 0.1 * z * random.Uniform(); };
    AppendBox(pose * scene::Translation(at) *
                  scene::RotationXyz({360 * random.Uniform(), 360 * random.Uniform(), 0}) *
                  scene::Scaling({size(), size(), size()}),
              0, geometry);
  }
  const scene::RayCaster rays(geometry);
  const auto ray_scene = MakeRayScene(device, geometry);
  std::vector<SurfacePoint> points;
  while (points.size() < 1500) {
    // From around the lamp: surfaces turned towards it, some of them in shadow.
    const Vec3 eye = pose.Point({random.Uniform() - 0.5, 0.5 * random.Uniform(), -0.3});
    const auto hit = rays.Intersect(
        {eye, pose.Vector({0.8 * (random.Uniform() - 0.5), 0.8 * (random.Uniform() - 0.5), 1})});
    if (!hit) continue;
    const auto corner = [&](int c) {
      const auto& v = geometry.corner(hit->triangle, c);
      return Vec3{v[0], v[1], v[2]};
    };
    const Vec3 a = corner(0), ab = corner(1) - a, ac = corner(2) - a;
    Vec3 n = Normalized(Cross(ab, ac));
    const Vec3 p = a + hit->b * ab + hit->c * ac;
    if (Dot(n, eye - p) < 0) n = -1.0 * n;
    points.push_back(RoundToFloat({p, n}));
  }
  const Pose luminaire_from_world = pose.Inverse();
  for (const bool on_image : {false, true}) {
    const auto lights =
        on_image ? ReferencePositions(lamp.geometry, tables.reference) : CellCentres(lamp);
    const int size = 192;
    const auto seen =
        Seen(ShadowMaps(device, lamp.geometry, lights, pose, *ray_scene, size), device, 20, points);
    int judged = 0, different = 0, unexplained = 0;
    for (std::size_t k = 0; k < points.size(); ++k)
      for (std::size_t cell = 0; cell < lights.size(); ++cell) {
        const auto [p, n] = points[k];
        const Vec3 light = pose.Point(lights[cell].position);
        const Vec3 local = luminaire_from_world.Point(p) - lights[cell].position;
        // Inside the map, and facing the light.
        if (Dot(n, light - p) <= 0 || local.z <= 0 || std::abs(local.x) > 0.45 * local.z ||
            std::abs(local.y) > 0.3 * local.z)
          continue;
        ++judged;
        const bool blocked = Blocked(rays, p + 1e-5 * n, light);
        if (seen[k][cell] == !blocked) continue;
        ++different;
        // The map's answer is that of some point within the stated reach. On I the map spans more.
        const double tangent =
            on_image ? 3 * TexelTangent(lamp.geometry, size) : TexelTangent(lamp.geometry, size);
        bool explained = false;
        for (int trial = 0; trial < 4000 && !explained; ++trial) {
          const Vec3 q = p + (kReach * tangent * local.z * std::cbrt(random.Uniform())) *
                                 RandomDirection(random);
          explained = Dot(n, q - p) > 0 && Blocked(rays, q, light) != blocked;
        }
        unexplained += !explained;
      }
    std::printf("seed %llu, lights on %s: %d of %d differ from rays, %d beyond the footprint\n",
                static_cast<unsigned long long>(kSeed), on_image ? "I" : "F", different, judged,
                unexplained);
    EXPECT_GT(judged, 5000);
    EXPECT_LT(different, 0.05 * judged);
    EXPECT_EQ(unexplained, 0);
  }
}

TEST(ShadowMaps, NoPlaneShadesItself) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto tables = preprocess::BuildTables(lamp, "test.lf.exr", std::string(64, '0'));
  core::Random random(kSeed, 3);
  for (const int size : {16, 64, 192})
    for (const bool on_image : {false, true})
      for (const double slope : {0.001, 0.03, 0.3, 1.0, 5.0})
        for (const double offset : {0.0, 2000.0}) {
          const auto lights =
              on_image ? ReferencePositions(lamp.geometry, tables.reference) : CellCentres(lamp);
          // A plane through (0, -0.2, 1) that rises by `slope` along z, the lamp above it.
          const Pose pose = scene::Translation({offset, 0, -offset});
          Geometry geometry;
          const Vec3 at = pose.Point({0, -0.2, 1}), along{0, slope, 1};
          AppendQuad(at + -50.0 * along + Vec3{-50, 0, 0}, {100, 0, 0}, 100.0 * along, 0, geometry);
          const Vec3 n = Normalized(Vec3{0, 1, -slope});
          std::vector<SurfacePoint> points;
          for (int k = 0; k < 300; ++k) {
            const Vec3 p = at + (random.Uniform() - 0.5) * Vec3{1, 0, 0} +
                           (4 * random.Uniform() - 0.5) * along;
            points.push_back(RoundToFloat({p, n}));
          }
          const auto seen = Seen(ShadowMaps(device, lamp.geometry, lights, pose,
                                            *MakeRayScene(device, geometry), size),
                                 device, 20, points);
          int hidden = 0, facing = 0;
          for (std::size_t k = 0; k < points.size(); ++k)
            for (std::size_t cell = 0; cell < lights.size(); ++cell) {
              if (Dot(n, pose.Point(lights[cell].position) - points[k].p) <= 0) continue;
              ++facing;
              hidden += !seen[k][cell];
            }
          EXPECT_GT(facing, 1000);
          EXPECT_EQ(hidden, 0) << "size " << size << ", on I " << on_image << ", slope " << slope
                               << ", offset " << offset;
        }
}

TEST(ShadowMaps, AnOccluderTwoFootprintsAboveAFloorLeaksNoLight) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto lights = CellCentres(lamp);
  const Pose above = scene::LookAt({0, 0, 2}, {0, 0, 0}, {0, 1, 0});
  const int size = 64;
  const double f = 2 * TexelTangent(lamp.geometry, size);  // on the floor
  Geometry geometry;
  AppendQuad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0, geometry);
  AppendQuad({-0.3, -0.3, 2 * f}, {0.6, 0, 0}, {0, 0.6, 0}, 0, geometry);
  std::vector<SurfacePoint> points;
  core::Random random(kSeed, 4);
  const double inside = 0.3 - kReach * f - 0.05;  // the cells' offsets move the shadow by some mm
  for (int k = 0; k < 300; ++k)
    points.push_back(
        RoundToFloat({{inside * (2 * random.Uniform() - 1), inside * (2 * random.Uniform() - 1), 0},
                      {0, 0, 1}}));
  for (const auto& seen :
       Seen(ShadowMaps(device, lamp.geometry, lights, above, *MakeRayScene(device, geometry), size),
            device, 20, points))
    EXPECT_THAT(seen, testing::Each(false));
  // Below the lift the occluder's shadow is lost: the price that the header states.
  Geometry contact;
  AppendQuad({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}, 0, contact);
  AppendQuad({-0.3, -0.3, 0.5 * kLift * f}, {0.6, 0, 0}, {0, 0.6, 0}, 0, contact);
  for (const auto& seen :
       Seen(ShadowMaps(device, lamp.geometry, lights, above, *MakeRayScene(device, contact), size),
            device, 20, points))
    EXPECT_THAT(seen, testing::Each(true));
}

TEST(ShadowMaps, AHousingAroundTheLampHidesWhatItDoesForRays) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto lights = CellCentres(lamp);
  // Four walls 8 cm off the axis from 5 cm behind F to 25 cm in front, and a back in F itself.
  Geometry housing;
  for (int side = 0; side < 4; ++side)
    for (const double s : {-1.0, 1.0}) {
      if (side % 2 == 0)
        AppendQuad({0.08 * s, -0.08, -0.05}, {0, 0.16, 0}, {0, 0, 0.3}, 0, housing);
      else
        AppendQuad({-0.08, 0.08 * s, -0.05}, {0.16, 0, 0}, {0, 0, 0.3}, 0, housing);
    }
  AppendQuad({-0.08, -0.08, 0}, {0.16, 0, 0}, {0, 0.16, 0}, 0, housing);
  const scene::RayCaster rays(housing);
  const auto points = FacingReceivers(400);
  const int size = 512;
  const double f = TexelTangent(lamp.geometry, size);
  const auto seen =
      Seen(ShadowMaps(device, lamp.geometry, lights, {}, *MakeRayScene(device, housing), size),
           device, 20, points);
  int hidden = 0, open = 0, doubtful = 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    for (std::size_t cell = 0; cell < lights.size(); ++cell) {
      // In front of the back, where shadow rays end.
      const Vec3 p = points[k].p, light = lights[cell].position + Vec3{0, 0, 1e-6};
      const bool blocked = Blocked(rays, p, light);
      const double reach = kReach * f * p.z;
      bool edge = false;
      for (const double dx : {-reach, reach})
        for (const double dy : {-reach, reach})
          edge |= Blocked(rays, p + Vec3{dx, dy, 0}, light) != blocked;
      if (edge) {
        ++doubtful;
        continue;
      }
      (blocked ? hidden : open) += 1;
      EXPECT_EQ(seen[k][cell], !blocked) << "point " << k << ", cell " << cell;
    }
  EXPECT_GT(hidden, 500);
  EXPECT_GT(open, 500);
  EXPECT_LT(doubtful, hidden + open);
}

TEST(ShadowMaps, TheMapsCoverAllLitReceiversFromDeltaOn) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto& g = lamp.geometry;
  Geometry wall;
  AppendQuad({-50, -50, 0.25}, {100, 0, 0}, {0, 100, 0}, 0, wall);
  const ShadowMaps maps(device, g, CellCentres(lamp), {}, *MakeRayScene(device, wall), 32);
  // Along the light's outermost rays.
  const double u = 0.5 * 5 * g.grid.spacing_m, s = 0.5 * g.lattice.extent_s_m(),
               v = 0.5 * 4 * g.grid.spacing_m, t = 0.5 * g.lattice.extent_t_m();
  std::vector<SurfacePoint> points;
  for (const double z : {0.3, 0.5, 1.0, 30.0, 1e4})
    for (const double a : {-1.0, 1.0})
      for (const double b : {-1.0, 1.0})
        for (const double from : {-1.0, 1.0}) {
          // Through the edge of the cells (from +-u) and of the image.
          const double x0 = from * u, y0 = from * v;
          points.push_back(RoundToFloat({{x0 + 0.999 * (a * s - x0) * z / g.delta_m,
                                          y0 + 0.999 * (b * t - y0) * z / g.delta_m, z},
                                         {0, 0, -1}}));
        }
  const auto seen = Seen(maps, device, 20, points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    // All cells of the outermost image on the side that the ray comes from.
    for (int cell = 0; cell < 9; ++cell)
      EXPECT_FALSE(seen[k][((k % 2 ? 1 : 0) + cell / 3) * 5 + (k % 2 ? 2 : 0) + cell % 3])
          << "point " << k << ", cell " << cell;
  }
  // No light gets there, and no map looks there: seen, whatever stands before it.
  const auto outside = Seen(maps, device, 20, {{{9, 0, 1}, {-1, 0, 0}}, {{0, 0, -1}, {0, 0, 1}}});
  EXPECT_THAT(outside[0], testing::Each(true));
  EXPECT_THAT(outside[1], testing::Each(true));  // behind the luminaire
}

TEST(ShadowMaps, EmptyAndHugeScenes) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto points = FacingReceivers(100);
  const ShadowMaps empty(device, lamp.geometry, CellCentres(lamp), {}, *MakeRayScene(device, {}),
                         16);
  for (const auto& seen : Seen(empty, device, 20, points)) EXPECT_THAT(seen, testing::Each(true));

  // A ground of 1000 km with a wall of 2 m at 100 m.
  Geometry huge;
  AppendQuad({-5e5, -0.65, -5e5}, {1e6, 0, 0}, {0, 0, 1e6}, 0, huge);
  AppendQuad({-2, -0.65, 100}, {4, 0, 0}, {0, 2, 0}, 0, huge);
  const ShadowMaps maps(device, lamp.geometry, CellCentres(lamp), {}, *MakeRayScene(device, huge),
                        512);
  const auto seen = Seen(maps, device, 20,
                         {{{0, -0.65f, 30}, {0, 1, 0}},     // ground before the wall
                          {{0, 0, 99.99f}, {0, 0, -1}},     // the wall itself, nearly
                          {{0, -0.65f, 130}, {0, 1, 0}},    // ground behind it
                          {{0, 1e4f, 1e5f}, {0, 0, -1}}});  // above it, far away
  EXPECT_THAT(seen[0], testing::Each(true));
  EXPECT_THAT(seen[1], testing::Each(true));
  EXPECT_THAT(seen[2], testing::Each(false));
  EXPECT_THAT(seen[3], testing::Each(true));
}

// The irradiance that image m alone gives to a receiver.
double ImageIrradiance(const lightfield::LightField& lamp, int m, const SurfacePoint& point) {
  lightfield::LightField alone(lamp.geometry);
  std::ranges::copy(lamp.image(m, 0), alone.image(m, 0).begin());
  return lightfield::ExactIrradiance(alone, point.p, point.n)[0];
}

TEST(ShadowMaps, EstimatorsWeighImagesByTheirVisibility) {
  const Device device = Device::Open();
  auto lamp = Lamp();
  // Image (2, 0) is dark: cells (4, 0) and the corner beside it carry no light.
  std::ranges::fill(lamp.image(2, 0), 0.0f);
  const auto tables = preprocess::BuildTables(lamp, "test.lf.exr", std::string(64, '0'));
  const LuminaireOnDevice on_device(device, lamp, {.sat = &tables});
  const auto lights = CellCentres(lamp);
  EXPECT_EQ(std::ranges::count_if(lights, &CellLight::lit), 19);
  for (std::size_t cell = 0; cell < lights.size(); ++cell)
    EXPECT_EQ(lights[cell].lit, tables.reference[cell].images > 0) << cell;

  // Slats in front of the lamp; the receivers' visibilities are judged by rays to the cells.
  Geometry slats;
  for (int k = -3; k <= 3; ++k) AppendQuad({0.03 * k, -1, 0.3}, {0.012, 0, 0}, {0, 2, 0}, 0, slats);
  const scene::RayCaster rays(slats);
  const int size = 512;
  const ShadowMaps maps(device, lamp.geometry, lights, {}, *MakeRayScene(device, slats), size);
  EXPECT_EQ(maps.map_count(), 19);
  std::vector<SurfacePoint> points;
  std::vector<double> judge, facing;
  for (SurfacePoint point : FacingReceivers(400)) {
    const Vec3 to_lamp = Normalized(-1.0 * point.p);
    // Every fourth horizon cuts the lamp.
    if (points.size() % 4 == 3)
      point = RoundToFloat({point.p, Normalized(Cross(to_lamp, Vec3{0, 1, 0}))});
    const double reach = kReach * TexelTangent(lamp.geometry, size) * point.p.z;
    double visibility[20];
    bool clear_cut = true;
    for (int cell = 0; cell < 20; ++cell) {
      const bool blocked = Blocked(rays, point.p, lights[cell].position);
      visibility[cell] = blocked ? 0 : 1;
      for (const double dx : {-reach, reach})
        clear_cut &= Blocked(rays, point.p + Vec3{dx, 0, 0}, lights[cell].position) == blocked;
    }
    if (!clear_cut) continue;
    double sum = 0;
    for (int m = 0; m < 6; ++m) {
      double seen = 0;
      for (int cell = 0; cell < 9; ++cell)
        seen += visibility[(m / 3 + cell / 3) * 5 + m % 3 + cell % 3] / 9;
      sum += seen * ImageIrradiance(lamp, m, point);
    }
    points.push_back(point);
    judge.push_back(sum);
    facing.push_back(lightfield::ExactIrradiance(lamp, point.p, to_lamp)[0]);
  }
  ASSERT_GT(points.size(), 100u);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto windowed = MakeEstimator("windowed", device);
  EstimatorOptions options;
  options.samples_per_pixel = 128;
  constexpr int kSeeds = 32;
  std::vector<double> sum(points.size()), square(points.size());
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = kSeed + seed;
    Lighting lighting(device, gbuffer);
    windowed->Light({gbuffer, {.maps = &maps}}, PosedLuminaire{on_device}, options, lighting);
    const auto irradiance = lighting.irradiance.Download<cl_float4>();
    for (std::size_t k = 0; k < points.size(); ++k) {
      sum[k] += irradiance[k].s[0];
      square[k] += double{irradiance[k].s[0]} * irradiance[k].s[0];
    }
  }
  double error = 0, variance = 0, t_square = 0;
  int pixels = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double mean = sum[k] / kSeeds;
    const double squared_error = (square[k] / kSeeds - mean * mean) / (kSeeds - 1);
    if (judge[k] == 0 || squared_error <= 0) {
      EXPECT_NEAR(mean, judge[k], 1e-5 * judge[k]);
      continue;
    }
    error += mean - judge[k];
    variance += squared_error;
    t_square += std::pow(mean - judge[k], 2) / squared_error;
    ++pixels;
  }
  // Without noise, horizons that cut the lamp included.
  const auto exact = MakeEstimator("exact", device);
  Lighting lighting(device, gbuffer);
  exact->Light({gbuffer, {.maps = &maps}}, PosedLuminaire{on_device}, {}, lighting);
  const auto irradiance = lighting.irradiance.Download<cl_float4>();
  for (std::size_t k = 0; k < points.size(); ++k)
    EXPECT_NEAR(irradiance[k].s[0], judge[k], 2e-5 * facing[k]) << k;

  const double expected = (kSeeds - 1.0) / (kSeeds - 3.0);
  std::printf("seed %llu: pooled error %.2f standard errors, mean t^2 %.3f over %d pixels\n",
              static_cast<unsigned long long>(kSeed), error / std::sqrt(variance),
              t_square / pixels, pixels);
  EXPECT_GT(pixels, 100);
  EXPECT_LT(std::abs(error), 3 * std::sqrt(variance));
  EXPECT_LT(t_square / pixels, expected + 6 * std::sqrt(2.8 / pixels));
}

TEST(ShadowMaps, DoNotDependOnGroupsOrOnHowPixelsAreSplit) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  Geometry slats;
  for (int k = -3; k <= 3; ++k) AppendQuad({0.03 * k, -1, 0.3}, {0.012, 0, 0}, {0, 2, 0}, 0, slats);
  const auto rays = MakeRayScene(device, slats);
  const auto points = FacingReceivers(150);
  const auto maps_on = [&](const Device& tuned) {
    return ShadowMaps(tuned, lamp.geometry, CellCentres(lamp), {}, *rays, 100);
  };
  const ShadowMaps maps = maps_on(device);
  const auto all = Seen(maps, device, 20, points);
  for (const int group : {1, 7, 128}) {
    auto tuning = device.tuning();
    tuning.group_size = group;
    EXPECT_EQ(Seen(maps_on(device.WithTuning(tuning)), device, 20, points), all) << group;
  }
  for (std::size_t k = 0; k < points.size(); k += 37)
    EXPECT_EQ(Seen(maps, device, 20, {points[k]})[0], all[k]);
}

TEST(ShadowMaps, RefuseWhatMakesNoSense) {
  const Device device = Device::Open();
  const auto lamp = Lamp();
  const auto rays = MakeRayScene(device, {});
  const auto lights = CellCentres(lamp);
  for (const int size : {-1, 0, 15, 4097})
    EXPECT_THROW(ShadowMaps(device, lamp.geometry, lights, {}, *rays, size), InputError) << size;
  EXPECT_THROW(ShadowsFromName("soft"), InputError);
  for (const auto shadows :
       {Shadows::kNone, Shadows::kTraced, Shadows::kMaps, Shadows::kThesisMaps, Shadows::kSoftMaps})
    EXPECT_EQ(ShadowsFromName(ShadowsName(shadows)), shadows);
  EstimatorTraits blind;
  blind.name = "blind";
  blind.traced_shadows = false;
  RequireShadows(blind, Shadows::kNone);
  EXPECT_THROW(RequireShadows(blind, Shadows::kTraced), InputError);
  try {
    RequireShadows(blind, Shadows::kMaps);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("'blind'"));
    EXPECT_THAT(error.what(), testing::HasSubstr("windowed"));
  }
}

}  // namespace
}  // namespace luxfield::render
