#include "luxfield/render/accuracy/accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numbers>
#include <vector>

#include "luxfield/bench/ball_scene.h"
#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/environment/environment_map.h"
#include "tests/render/area_light_fixture.h"
#include "tests/render/small_scene.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

// Made-up times; pilots correct them.
CostModel MadeUpCosts() {
  CostModel costs;
  costs.coefficients_s["exact"] = {0, 1e-6, 0, 0, 0, 0};
  costs.coefficients_s["windowed"] = {0, 0, 0, 0, 1e-7, 0};
  return costs;
}

class AccuracyTest : public testing::Test {
 protected:
};

// Over targets and seeds the true error must lie within the target in 95 % of cases: three standard
// deviations below that are allowed.
TEST_F(AccuracyTest, ErrorsAskedForAreKept) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.estimator = "exact";
  const auto reference = render::Renderer(scene, request.picture).Render();
  request.estimators = {"windowed"};
  int runs = 0, kept = 0;
  for (const double target : {0.1, 0.05, 0.02})
    for (int seed = 1; seed <= 10; ++seed) {
      request.rel_error = target;
      request.picture.seed = static_cast<std::uint64_t>(seed);
      const auto result = RenderToAccuracy(scene, MadeUpCosts(), request);
      EXPECT_TRUE(result.met);
      const double error = LuminanceError(result.frame.radiance, reference.radiance);
      ++runs;
      kept += error <= target ? 1 : 0;
      std::printf("asked %.3f, estimated %.4f, true %.4f, %d samples, seed %d\n", target,
                  result.estimated_error, error, result.chosen.samples_per_pixel, seed);
      EXPECT_GT(result.estimated_error, 0.3 * target);  // not bought by far too many samples
    }
  EXPECT_GE(kept, 0.95 * runs - 3 * std::sqrt(0.95 * 0.05 * runs));
}

// So few pixels tell their noise less well than the choice of samples expects, and further rounds
// follow. No time plays a part: samples are all that costs.
TEST_F(AccuracyTest, FurtherRoundsAreTakenUntilTheErrorIsMet) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.width = 8;
  request.picture.height = 6;
  request.picture.estimator = "exact";
  const auto reference = render::Renderer(scene, request.picture).Render();
  request.estimators = {"windowed"};
  request.rel_error = 0.05;
  constexpr int kRuns = 8;
  int further = 0, kept = 0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    request.picture.seed = static_cast<std::uint64_t>(seed);
    const auto result = RenderToAccuracy(scene, MadeUpCosts(), request);
    EXPECT_TRUE(result.met) << "seed " << seed;
    EXPECT_LE(result.estimated_error, *request.rel_error);
    const double error = LuminanceError(result.frame.radiance, reference.radiance);
    std::printf("%d rounds, %d samples, estimated %.4f, true %.4f, seed %d\n", result.rounds,
                result.chosen.samples_per_pixel, result.estimated_error, error, seed);
    kept += error <= *request.rel_error;
    further += result.rounds > 1;
  }
  EXPECT_GT(further, 0);
  EXPECT_GE(kept, 0.95 * kRuns - 3 * std::sqrt(0.95 * 0.05 * kRuns));
}

// For those who watch: what pictures on the way state is their true squared error in the mean over
// the seeds, and the last ones keep the error asked for.
TEST_F(AccuracyTest, PicturesOnTheWayStateTheirError) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.estimator = "exact";
  const auto reference = render::Renderer(scene, request.picture).Render();
  request.estimators = {"windowed"};
  request.rel_error = 0.02;
  request.round_s = 1e-9;
  constexpr int kRuns = 30;
  const std::uint64_t first_seed = TestSeed(1);
  std::map<int, std::vector<double>> ratios;  // of squared errors, by the round
  int kept = 0;
  for (int run = 0; run < kRuns; ++run) {
    request.picture.seed = first_seed + static_cast<std::uint64_t>(run);
    const auto rendering = BeginRendering(scene, MadeUpCosts(), request);
    while (!rendering->done()) {
      rendering->TakeRound();
      const AccurateFrame& result = rendering->result();
      const double error = LuminanceError(result.frame.radiance, reference.radiance);
      ratios[result.rounds].push_back(std::pow(error / result.estimated_error, 2));
      EXPECT_EQ(result.met, rendering->done());
      if (rendering->done()) kept += error <= *request.rel_error;
    }
    EXPECT_GT(rendering->result().rounds, 2);
  }
  EXPECT_GE(kept, 0.95 * kRuns - 3 * std::sqrt(0.95 * 0.05 * kRuns));
  for (const auto& [round, of_runs] : ratios) {
    if (of_runs.size() < kRuns) continue;
    double mean = 0, square = 0;
    for (const double ratio : of_runs) mean += ratio / kRuns;
    for (const double ratio : of_runs) square += std::pow(ratio - mean, 2) / (kRuns - 1);
    std::printf("round %d: squared error over what is stated %.3f +- %.3f\n", round, mean,
                std::sqrt(square / kRuns));
    // Student's t of 29 degrees of freedom, as rare as 4.5 standard deviations. Noise of 250 pixels
    // that are lit again knows its scale to some 5 %.
    EXPECT_NEAR(mean, 1, 0.05 + 5.7 * std::sqrt(square / kRuns)) << "round " << round;
  }
}

// Of as many samples, those that are dealt out by the noise leave less of it.
TEST_F(AccuracyTest, SamplesGoWhereTheNoiseIs) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.estimator = "exact";
  const auto reference = render::Renderer(scene, request.picture).Render();
  request.estimators = {"windowed"};
  request.rel_error = 0.02;
  double dealt = 0, even = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    request.picture.seed = seed;
    const auto result = RenderToAccuracy(scene, MadeUpCosts(), request);
    double samples = 0, hits = 0;
    for (std::size_t i = 0; i < result.frame.samples.data.size(); ++i) {
      samples += result.frame.samples.data[i];
      hits += result.frame.coverage.data[i] > 0;
    }
    EXPECT_NEAR(result.chosen.samples_per_pixel, samples / hits, 0.02 * samples / hits + 1);
    render::RenderOptions picture = request.picture;
    picture.estimator = "windowed";
    picture.samples_per_pixel = result.chosen.samples_per_pixel;
    const auto frame = render::Renderer(scene, picture).Render();
    dealt += std::pow(LuminanceError(result.frame.radiance, reference.radiance), 2);
    even += std::pow(LuminanceError(frame.radiance, reference.radiance), 2);
  }
  std::printf("squared error of dealt samples over that of even ones: %.3f, seeds 1 to 8\n",
              dealt / even);
  EXPECT_LT(dealt, 0.8 * even);
}

// One sample of a surface point would tell nothing of its variance: where all light is known but for
// what is hidden of it, that is the picture's whole error.
TEST_F(AccuracyTest, EverySurfacePointShowsItsVariance) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.antialias = 4;
  request.estimators = {"exact"};
  request.rel_error = 0.2;
  const Frame frame = RenderToAccuracy(scene, MadeUpCosts(), request).frame;
  // Points that the lamp's support does not reach take none.
  int lit = 0, whole = 0;
  for (std::size_t i = 0; i < frame.samples.data.size(); ++i)
    if (frame.coverage.data[i] == 1 && frame.radiance.data[i] > 0) {
      ++lit;
      whole += frame.samples.data[i] >= 2 * 4;
      EXPECT_GE(frame.samples.data[i], 2) << i;
    }
  EXPECT_GT(lit, 100);
  EXPECT_GT(whole, 0.9 * lit);
}

TEST_F(AccuracyTest, TheCheapestSettingIsTaken) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.estimators = {"windowed", "exact"};
  request.rel_error = 0.01;
  const auto result = RenderToAccuracy(scene, MadeUpCosts(), request);
  ASSERT_GE(result.considered.size(), 1u);
  EXPECT_EQ(result.chosen.estimator, result.considered[0].estimator);
  for (const auto& setting : result.considered)  // windowed may have been left out
    EXPECT_LE(result.considered[0].predicted_s, setting.predicted_s);
  EXPECT_TRUE(result.met);
  EXPECT_LE(result.estimated_error, 0.01);
}

TEST_F(AccuracyTest, ABlackPictureHasNoErrorLeft) {
  scene::Scene black = LampOverFloor();
  for (auto& material : black.geometry.materials) material.albedo = {0, 0, 0};
  render::LitScene scene(render::Device::Open(), black);
  AccuracyRequest request;
  request.rel_error = 0.03;
  const auto result = RenderToAccuracy(scene, MadeUpCosts(), request);
  EXPECT_TRUE(result.met);
  EXPECT_EQ(result.estimated_error, 0);
  ASSERT_FALSE(result.considered.empty());
  for (const auto& setting : result.considered)
    EXPECT_TRUE(std::isfinite(setting.predicted_error)) << setting.estimator;
}

TEST(StatesItsError, FollowsTheTraits) {
  for (const auto& traits : render::EstimatorList())
    for (const bool shadows : {false, true}) {
      const bool unbiased = shadows ? traits.unbiased_with_shadows : traits.unbiased;
      if (unbiased && !traits.noise_free) {
        EXPECT_TRUE(StatesItsError(traits, true, shadows)) << traits.name;
        EXPECT_TRUE(StatesItsError(traits, false, shadows)) << traits.name;
      }
      if (traits.name == "thesis") {
        EXPECT_FALSE(StatesItsError(traits, false, shadows));
      }
      if (traits.name == "exact" || traits.name == "volume") {
        EXPECT_TRUE(StatesItsError(traits, false, shadows));
        EXPECT_FALSE(StatesItsError(traits, true, shadows));
        EXPECT_EQ(TakesSamples(traits, shadows), shadows);
      }
      // The same as exact on Lambertian surfaces.
      if (traits.name == "gloss") {
        EXPECT_TRUE(StatesItsError(traits, true, shadows));
        EXPECT_FALSE(StatesItsError(traits, false, shadows));
      }
    }
}

// A time is turned into samples, more time into more of them.
TEST_F(AccuracyTest, TimesBecomeSamples) {
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.estimators = {"windowed"};
  request.time_s = 0.01;
  const int few = RenderToAccuracy(scene, MadeUpCosts(), request).chosen.samples_per_pixel;
  request.time_s = 0.5;
  const int many = RenderToAccuracy(scene, MadeUpCosts(), request).chosen.samples_per_pixel;
  EXPECT_GT(many, few);
}

TEST_F(AccuracyTest, WrongRequestsAreNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  render::LitScene scene(render::Device::Open(), LampOverFloor());
  AccuracyRequest request;
  EXPECT_THROW(RenderToAccuracy(scene, MadeUpCosts(), request), InputError);
  request.rel_error = 1e-9;
  EXPECT_THAT([&] { RenderToAccuracy(scene, MadeUpCosts(), request); },
              ThrowsMessage<InputError>(HasSubstr("0.002 %")));
  request.rel_error = 0.01;
  request.time_s = 1;
  EXPECT_THROW(RenderToAccuracy(scene, MadeUpCosts(), request), InputError);
  request.time_s.reset();
  request.estimators = {"thesis"};
  EXPECT_THAT([&] { RenderToAccuracy(scene, MadeUpCosts(), request); },
              ThrowsMessage<InputError>(HasSubstr("states its error")));
}

// Under a sky alone: the true picture is in closed form, albedo / pi times the texel sum.
TEST_F(AccuracyTest, ErrorsAskedForUnderASkyAreKept) {
  const auto sky = std::filesystem::path(testing::TempDir()) / "luxfield_bright_sky.exr";
  core::Image picture(64, 32, 3);
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 64; ++column)
      for (int c = 0; c < 3; ++c)
        picture.at(c, row, column) = 1 + 0.01f * static_cast<float>(column) +
                                     (std::hypot(column - 40, row - 6) < 3 ? 30.0f : 0.0f);
  core::WriteExrImage(sky, picture);
  scene::Scene balls = bench::BallScene(48, 36);
  scene::MakeLambertian(balls.geometry);
  balls.environment.emplace();
  balls.environment->file = sky;
  balls.environment->face_size = 16;
  render::LitScene scene(render::Device::Open(), balls);
  const auto map = environment::MakeCubeMap(environment::ReadEnvironmentPicture(sky), 16);

  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.samples_per_pixel = 16;
  render::Frame exact = render::Renderer(scene, request.picture).Render();
  for (int row = 0; row < exact.height; ++row)
    for (int column = 0; column < exact.width; ++column) {
      if (exact.coverage.at(0, row, column) == 0) continue;
      const core::Rgb e = environment::Irradiance(
          map, {exact.normal.at(0, row, column), exact.normal.at(1, row, column),
                exact.normal.at(2, row, column)});
      for (int c = 0; c < 3; ++c)
        exact.radiance.at(c, row, column) *=
            static_cast<float>(e[c] / exact.irradiance.at(c, row, column));
    }
  int runs = 0, kept = 0;
  std::array<int, 2> rounds{};  // as few as can be, and with pictures on the way
  for (const double target : {0.03, 0.01, 0.004})
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      request.rel_error = target;
      request.picture.seed = seed;
      request.round_s.reset();
      if (seed % 2 == 1) request.round_s = 1e-9;
      const auto result = RenderToAccuracy(scene, {}, request);
      rounds[seed % 2] += result.rounds;
      EXPECT_TRUE(result.met);
      const double error = LuminanceError(result.frame.radiance, exact.radiance);
      ++runs;
      kept += error <= target ? 1 : 0;
      std::printf("asked %.3f, estimated %.4f, true %.4f, %d samples, seed %d\n", target,
                  result.estimated_error, error, result.chosen.samples_per_pixel,
                  static_cast<int>(seed));
      EXPECT_GT(result.estimated_error, 0.3 * target);  // not bought by far too many samples
    }
  EXPECT_GE(kept, 0.95 * runs - 3 * std::sqrt(0.95 * 0.05 * runs));
  EXPECT_GT(rounds[1], rounds[0]);

  request.rel_error.reset();
  request.time_s = 0.05;
  const auto quick = RenderToAccuracy(scene, {}, request);
  EXPECT_TRUE(quick.met);
  EXPECT_GE(quick.chosen.samples_per_pixel, 8);
  request.picture.knobs.environment.sets = render::SampleSets::kShared;
  EXPECT_THAT([&] { RenderToAccuracy(scene, {}, request); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("scrambled")));
}

// Under a rectangle and a sphere: grey albedo / pi times the formulas for their irradiance.
TEST_F(AccuracyTest, ErrorsAskedForUnderAreaLightsAreKept) {
  scene::Scene balls = bench::BallScene(48, 36);
  scene::MakeLambertian(balls.geometry);
  for (scene::Material& material : balls.geometry.materials) material.albedo = {0.5f, 0.5f, 0.5f};
  scene::AreaLight rectangle, sphere;
  rectangle.kind = scene::AreaLightKind::kRectangle;
  rectangle.radiance = {6, 6, 6};
  rectangle.width_m = 0.8;
  rectangle.height_m = 0.5;
  rectangle.world_from_light = scene::LookAt({-0.5, -0.4, 2}, {0, 0, 0.3}, {0, 1, 0});
  sphere.kind = scene::AreaLightKind::kSphere;
  sphere.radiance = {20, 20, 20};
  sphere.radius_m = 0.1;
  sphere.world_from_light = scene::Translation({1.5, -1.5, 1.5});
  balls.area_lights = {rectangle, sphere};
  render::LitScene scene(render::Device::Open(), balls);

  AccuracyRequest request;
  request.picture.shadows = render::Shadows::kNone;
  request.picture.samples_per_pixel = 16;
  const render::Frame sampled = render::Renderer(scene, request.picture).Render();
  core::Image exact(48, 36, 3);
  for (int row = 0; row < 36; ++row)
    for (int column = 0; column < 48; ++column) {
      if (sampled.coverage.at(0, row, column) == 0) continue;
      const auto at = [&](const core::Image& image) {
        return scene::Vec3{image.at(0, row, column), image.at(1, row, column),
                           image.at(2, row, column)};
      };
      double irradiance = 0;
      for (const auto& light : balls.area_lights)
        irradiance += render::ExactIrradiance(light, {at(sampled.position), at(sampled.normal)});
      for (int c = 0; c < 3; ++c)
        exact.at(c, row, column) = static_cast<float>(0.5 / std::numbers::pi * irradiance);
    }
  int runs = 0, kept = 0;
  for (const double target : {0.03, 0.01})
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      request.rel_error = target;
      request.picture.seed = seed;
      const auto result = RenderToAccuracy(scene, {}, request);
      EXPECT_TRUE(result.met);
      const double error = LuminanceError(result.frame.radiance, exact);
      ++runs;
      kept += error <= target ? 1 : 0;
      std::printf("asked %.3f, estimated %.4f, true %.4f, %d samples, seed %d\n", target,
                  result.estimated_error, error, result.chosen.samples_per_pixel,
                  static_cast<int>(seed));
    }
  EXPECT_GE(kept, 0.95 * runs - 3 * std::sqrt(0.95 * 0.05 * runs));
}

}  // namespace
}  // namespace luxfield::render
