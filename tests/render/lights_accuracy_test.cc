// Errors and times asked of scenes that luminaires, area lights and an environment light together.
#include "luxfield/render/accuracy/lights_accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/environment/environment_map.h"
#include "tests/render/area_light_fixture.h"
#include "tests/render/small_scene.h"

namespace luxfield::render {
namespace {

constexpr int kSkyFace = 8;

std::filesystem::path SkyFile() {
  return std::filesystem::path(testing::TempDir()) / "luxfield_sky_of_all_lights.exr";
}

// A lamp, a lamp of little light, a rectangle, a sphere and a sky with a bright spot.
scene::Scene AllLights() {
  core::Image picture(32, 16, 3);
  for (int row = 0; row < 16; ++row)
    for (int column = 0; column < 32; ++column)
      for (int c = 0; c < 3; ++c)
        picture.at(c, row, column) = 0.2f + 0.01f * static_cast<float>(column) +
                                     (std::hypot(column - 20, row - 3) < 2 ? 8.0f : 0.0f);
  core::WriteExrImage(SkyFile(), picture);
  scene::Scene scene = LampOverFloor();
  scene.luminaires.push_back(scene.luminaires[0]);
  scene.luminaires[1].name = "faint";
  scene.luminaires[1].scale = 0.05;
  scene.luminaires[1].world_from_luminaire = scene::LookAt({1.5, 0.5, 1}, {0.5, 2.5, 0}, {0, 0, 1});
  scene::AreaLight rectangle, sphere;
  rectangle.kind = scene::AreaLightKind::kRectangle;
  rectangle.radiance = {3, 3, 3};
  rectangle.width_m = 0.8;
  rectangle.height_m = 0.5;
  rectangle.world_from_light = scene::LookAt({-0.5, 2, 2}, {0, 2.5, 0}, {0, 1, 0});
  sphere.kind = scene::AreaLightKind::kSphere;
  sphere.radiance = {20, 20, 20};
  sphere.radius_m = 0.1;
  sphere.world_from_light = scene::Translation({1.5, 2, 0.8});
  scene.area_lights = {rectangle, sphere};
  scene.environment.emplace();
  scene.environment->file = SkyFile();
  scene.environment->face_size = kSkyFace;
  return scene;
}

// Without shadows: the luminaires by `exact`, the rest by formula, the sky behind as `scene` shows
// it.
core::Image ExactPicture(const scene::Scene& all, render::LitScene& lit) {
  scene::Scene luminaires = all;
  luminaires.area_lights.clear();
  luminaires.environment.reset();
  render::LitScene scene(render::Device::Open(), luminaires);
  render::RenderOptions options;
  options.estimator = "exact";
  options.shadows = render::Shadows::kNone;
  const render::Frame lamps = render::Renderer(scene, options).Render(),
                      seen = render::Renderer(lit, options).Render();
  const auto sky =
      environment::MakeCubeMap(environment::ReadEnvironmentPicture(SkyFile()), kSkyFace);
  const double albedo = all.geometry.materials[0].albedo[0];
  core::Image exact = lamps.radiance;
  for (int row = 0; row < exact.height; ++row)
    for (int column = 0; column < exact.width; ++column) {
      if (lamps.coverage.at(0, row, column) == 0) {
        for (int c = 0; c < 3; ++c) exact.at(c, row, column) = seen.radiance.at(c, row, column);
        continue;
      }
      const auto at = [&](const core::Image& image) {
        return scene::Vec3{image.at(0, row, column), image.at(1, row, column),
                           image.at(2, row, column)};
      };
      double e = environment::Irradiance(sky, at(lamps.normal))[1];
      for (const auto& light : all.area_lights)
        e += render::ExactIrradiance(light, {at(lamps.position), at(lamps.normal)});
      for (int c = 0; c < 3; ++c)
        exact.at(c, row, column) += static_cast<float>(albedo / std::numbers::pi * e);
    }
  return exact;
}

class LightsAccuracyTest : public testing::Test {
 protected:
};

// Pictures of several seeds for errors asked for.
struct Kept {
  int runs = 0, kept = 0;
  double squares = 0, estimated = 0;  // of true and of estimated errors

  void Add(const AccurateFrame& result, double target, const core::Image& truth,
           std::uint64_t seed) {
    EXPECT_TRUE(result.met);
    const double error = LuminanceError(result.frame.radiance, truth);
    ++runs;
    kept += error <= target ? 1 : 0;
    squares += error * error;
    estimated += std::pow(result.estimated_error, 2);
    std::printf("asked %.3f, estimated %.4f, true %.4f, %s, %d samples, seed %d\n", target,
                result.estimated_error, error, result.chosen.estimator.c_str(),
                result.chosen.samples_per_pixel, static_cast<int>(seed));
    EXPECT_GT(result.estimated_error, 0.3 * target);  // not bought by far too many samples
  }
  // In 95 % of cases: three standard deviations below that are allowed. What is said of the error
  // is within a fifth of it: its root mean square over the runs scatters by less than a twentieth.
  void Judge() const {
    EXPECT_GE(kept, 0.95 * runs - 3 * std::sqrt(0.95 * 0.05 * runs));
    std::printf("estimated over true error %.3f\n", std::sqrt(estimated / squares));
    EXPECT_NEAR(std::sqrt(estimated / squares), 1, 0.2);
  }
};

TEST_F(LightsAccuracyTest, ErrorsAskedForAreKeptAndStatedHonestly) {
  const scene::Scene all = AllLights();
  render::LitScene scene(render::Device::Open(), all);
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.estimators = {"windowed"};
  const core::Image exact = ExactPicture(all, scene);
  for (const double target : {0.1, 0.02}) {
    Kept kept;
    request.rel_error = target;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      request.picture.seed = seed;
      kept.Add(RenderToAccuracy(scene, {}, request), target, exact, seed);
    }
    kept.Judge();
  }
}

// Shadows, gloss and two points a pixel: against a picture of a hundred times the samples.
TEST_F(LightsAccuracyTest, ErrorsAreKeptWithShadowsAndGloss) {
  scene::Scene all = AllLights();
  all.geometry.materials[0].kind = scene::MaterialKind::kGgx;
  all.geometry.materials[0].roughness = 0.5f;
  all.camera.width = 32;
  all.camera.height = 24;
  render::LitScene scene(render::Device::Open(), all);
  AccuracyRequest request;
  request.estimators = {"cells"};
  request.picture.antialias = 2;
  request.picture.samples_per_pixel = 12000;
  request.picture.seed = 77;
  const core::Image truth = render::Renderer(scene, request.picture).Render().radiance;
  request.rel_error = 0.05;
  Kept kept;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    request.picture.seed = seed;
    kept.Add(RenderToAccuracy(scene, {}, request), 0.05, truth, seed);
  }
  kept.Judge();
}

// Classical lights alone: a point, whose picture has no noise, a line and an area before a box. The
// error that is asked for is relative to the picture, against one of a hundred times the samples.
TEST_F(LightsAccuracyTest, ErrorsAreKeptByClassicalLightsAlone) {
  const auto file = std::filesystem::path(testing::TempDir()) / "luxfield_classical.ies";
  std::ofstream(file) << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 1 1 2 0 0 0\n1 1 10\n"
                         "0 30 60 90\n0\n100 80 30 5\n";
  const auto light = [&](scene::ClassicalModel model, double x, double y, scene::Vec3 at) {
    return scene::ClassicalLight{
        "light", model, file, std::array{x, y}, scene::LookAt(at, {0.2, 2.5, 0}, {1, 0, 0}), 1};
  };
  scene::Scene all = LampOverFloor();
  all.luminaires.clear();
  using enum scene::ClassicalModel;
  all.classical_lights = {light(kPoint, 0, 0, {-1, 2, 1.5}), light(kLinear, 1.2, 0, {0, 1, 1}),
                          light(kArea, 0.6, 0.3, {1.5, 3, 1.2})};
  render::LitScene scene(render::Device::Open(), all);
  AccuracyRequest request;
  request.picture.samples_per_pixel = 6000;
  request.picture.seed = 77;
  const core::Image truth = render::Renderer(scene, request.picture).Render().radiance;
  request.rel_error = 0.03;
  Kept kept;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    request.picture.seed = seed;
    kept.Add(RenderToAccuracy(scene, {}, request), 0.03, truth, seed);
  }
  kept.Judge();
}

// The way that is expected to be cheapest is taken; more time means more samples of every light
// that has noise, and what is predicted to be taken is not above the time asked for.
TEST_F(LightsAccuracyTest, TheCheapestWayIsTakenAndTimesBecomeSamples) {
  render::LitScene scene(render::Device::Open(), AllLights());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.estimators = {"windowed", "exact"};
  request.rel_error = 0.05;
  const AccurateFrame result = RenderToAccuracy(scene, {}, request);
  ASSERT_EQ(result.considered.size(), 2u);
  EXPECT_EQ(result.chosen.estimator, result.considered[0].estimator);
  EXPECT_LE(result.considered[0].predicted_s, result.considered[1].predicted_s);

  request.rel_error.reset();
  request.estimators = {"windowed"};
  const auto samples_in = [&](double seconds) {
    request.time_s = seconds;
    return RenderToAccuracy(scene, {}, request).chosen.samples_per_pixel;
  };
  const int few = samples_in(0.005), many = samples_in(0.5);
  EXPECT_GE(few, 2 * 5);  // of each light, to show a variance
  EXPECT_GT(many, few);
}

// No light reaches anything: there is no noise that rounds could be weighed by.
TEST_F(LightsAccuracyTest, DarkScenesAreBlack) {
  const auto night = std::filesystem::path(testing::TempDir()) / "luxfield_night.exr";
  core::WriteExrImage(night, core::Image(16, 8, 3));
  scene::Scene scene = LampOverFloor();
  scene.luminaires[0].scale = 0;
  scene.environment.emplace();
  scene.environment->file = night;
  render::LitScene lit(render::Device::Open(), scene);
  for (const bool timed : {true, false}) {
    AccuracyRequest request;
    request.picture.shadows = render::Shadows::kNone;
    if (timed)
      request.time_s = 0.3;
    else
      request.rel_error = 0.05;
    const AccurateFrame result = RenderToAccuracy(lit, {}, request);
    for (const core::Image* image : {&result.frame.radiance, &result.frame.variance})
      for (const float value : image->data) ASSERT_EQ(value, 0) << (timed ? "time" : "error");
  }
}

TEST_F(LightsAccuracyTest, WhatCannotBeServedIsRefusedWithoutAPicture) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  render::LitScene scene(render::Device::Open(), AllLights());
  AccuracyRequest request;
  request.rel_error = 0.05;
  RequireServable(scene, request);
  EXPECT_FALSE(ReadsCostModel(scene, request));
  request.estimators = {"thesis"};
  EXPECT_THAT([&] { RequireServable(scene, request); },
              ThrowsMessage<InputError>(HasSubstr("states its error")));
  request.estimators.clear();
  request.picture.knobs.environment.sets = render::SampleSets::kShared;
  EXPECT_THAT([&] { RequireServable(scene, request); },
              ThrowsMessage<InputError>(HasSubstr("scrambled")));
  // Of lamps alone the cost model is read, and they too are refused before it is measured.
  render::LitScene lamp(render::Device::Open(), LampOverFloor());
  EXPECT_TRUE(ReadsCostModel(lamp, request));
  request.estimators = {"thesis"};
  EXPECT_THAT([&] { RequireServable(lamp, request); },
              ThrowsMessage<InputError>(HasSubstr("states its error")));
}

// What keeps the time comes before what does not, and of that the most accurate one.
TEST(Settings, AreRankedByWhatIsAskedFor) {
  AccuracyRequest error, time;
  error.rel_error = 0.1;
  time.time_s = 1;
  const Setting quick{"quick", 10, 0.5, 0.2}, good{"good", 20, 0.999, 0.1},
      late{"late", 2, 2, 0.01}, later{"later", 2, 3, 0.001};
  EXPECT_TRUE(IsBetter(error, quick, good));
  EXPECT_TRUE(IsBetter(error, late, later));
  EXPECT_TRUE(IsBetter(time, good, quick));
  EXPECT_TRUE(IsBetter(time, quick, late));
  EXPECT_FALSE(IsBetter(time, late, quick));
  EXPECT_TRUE(IsBetter(time, late, later));
}

}  // namespace
}  // namespace luxfield::render
