// Samples of each light by itself, and what a frame tells of each light.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/renderer.h"
#include "tests/render/small_scene.h"

namespace luxfield::render {
namespace {

// Two lamps, a sphere and a sky.
scene::Scene FourLights() {
  const auto sky = std::filesystem::path(testing::TempDir()) / "luxfield_lights_apart_sky.exr";
  core::Image picture(16, 8, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i)
    picture.data[i] = 0.05f + 0.01f * static_cast<float>(i % 16);
  core::WriteExrImage(sky, picture);
  scene::Scene scene = render::LampOverFloor();
  scene.luminaires.push_back(scene.luminaires[0]);
  scene.luminaires[1].name = "dimmed";
  scene.luminaires[1].scale = 0.5;
  scene.luminaires[1].world_from_luminaire = scene::LookAt({1.5, 0.5, 1}, {0.5, 2.5, 0}, {0, 0, 1});
  scene::AreaLight sphere;
  sphere.kind = scene::AreaLightKind::kSphere;
  sphere.radiance = {20, 20, 20};
  sphere.radius_m = 0.1;
  sphere.world_from_light = scene::Translation({1.5, 2, 0.8});
  scene.area_lights = {sphere};
  scene.environment.emplace();
  scene.environment->file = sky;
  scene.camera.width = 24;
  scene.camera.height = 18;
  return scene;
}

double Mean(const core::Image& image) {
  return std::accumulate(image.data.begin(), image.data.end(), 0.0) /
         static_cast<double>(image.data.size());
}

class LightsApartTest : public testing::Test {
 protected:
  LightsApartTest() : scene(Device::Open(), FourLights()) {}

  Frame Render() { return Renderer(scene, options).Render(); }

  LitScene scene;
  RenderOptions options;
};

// Every light takes the samples that are its own, and lights with none of the others' samples as it
// does beside them: pictures of single lights add up to that of all.
TEST_F(LightsApartTest, TakeSamplesOfTheirOwn) {
  options.estimator = "windowed";
  options.relight = false;
  options.lights_apart = true;
  options.antialias = 2;
  const std::vector<int> samples = {24, 8, 40, 16};
  options.light_samples = samples;
  const Frame all = Render();
  std::vector<double> sum(all.radiance.data.size(), 0.0);
  // What is seen of the sky is in every picture.
  options.light_samples.assign(4, 0);
  const Frame none = Render();
  EXPECT_EQ(Mean(none.samples), 0);
  EXPECT_EQ(none.times.lighting_s, 0);
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = none.radiance.data[i];
  for (std::size_t l = 0; l < 4; ++l) {
    options.light_samples.assign(4, 0);
    options.light_samples[l] = samples[l];
    const Frame one = Render();
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += double{one.radiance.data[i]} - none.radiance.data[i];
    // Of the sky a tile of less than one sample takes one.
    const float most = *std::max_element(one.samples.data.begin(), one.samples.data.end());
    if (l < 3)
      EXPECT_EQ(most, static_cast<float>(samples[l])) << "light " << l;
    else
      EXPECT_GE(most, static_cast<float>(samples[l]));
    EXPECT_DOUBLE_EQ(one.lights[l].mean_luminance, all.lights[l].mean_luminance);
    EXPECT_DOUBLE_EQ(one.lights[l].mean_variance, all.lights[l].mean_variance);
    EXPECT_GT(one.times.light_s[l], 0);
    EXPECT_EQ(one.lights[(l + 1) % 4].mean_luminance, 0);
    EXPECT_EQ(one.times.light_s[(l + 1) % 4], 0);
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
    EXPECT_NEAR(all.radiance.data[i], sum[i], 2e-6 * std::abs(sum[i]) + 1e-12);
  double luminance = Mean(core::LuminanceImage(none.radiance)), variance = 0;
  for (const LightTotals& light : all.lights) {
    luminance += light.mean_luminance;
    variance += light.mean_variance;
  }
  EXPECT_NEAR(luminance, Mean(core::LuminanceImage(all.radiance)), 1e-5 * luminance);
  EXPECT_NEAR(variance, Mean(all.variance), 1e-5 * variance);
  options.light_samples = {1, 2, 3};
  EXPECT_THAT([&] { Render(); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("3 lights where")));
}

// Over pixels, the mean of the variance of pictures of a value.
double MeanSpread(const std::vector<core::Image>& pictures) {
  const auto count = static_cast<double>(pictures.size());
  double spread = 0;
  for (std::size_t i = 0; i < pictures[0].data.size(); ++i) {
    double mean = 0, squares = 0;
    for (const auto& picture : pictures) mean += picture.data[i] / count;
    for (const auto& picture : pictures) squares += std::pow(picture.data[i] - mean, 2);
    spread += squares / (count - 1);
  }
  return spread / static_cast<double>(pictures[0].data.size());
}

// What frames say of the variance of each light is the scatter of its pictures over seeds, in one
// pass that is lit again at some pixels and in four passes: also of lights that are hardly any of
// the whole's.
TEST_F(LightsApartTest, StateTheVarianceOfEachLight) {
  // What one frame states of a light that is hardly any of the whole's hangs on a few pixels that are
  // lit again: its mean takes many frames.
  constexpr int kSeeds = 80, kStated = 240;
  options.estimator = "windowed";
  const std::vector<int> samples = {32, 16, 32, 48};
  for (const int passes : {1, 4}) {
    options.passes = passes;
    options.light_samples = samples;
    options.lights_apart = options.relight = true;
    std::vector<std::vector<double>> stated(4);
    for (int seed = 1; seed <= kStated; ++seed) {
      options.seed = static_cast<std::uint64_t>(1000 + seed);
      const Frame frame = Render();
      for (std::size_t l = 0; l < 4; ++l) stated[l].push_back(frame.lights[l].mean_variance);
    }
    options.lights_apart = options.relight = false;
    for (std::size_t l = 0; l < 4; ++l) {
      // The light alone, whose pictures scatter as its part of the whole does.
      options.light_samples.assign(4, 0);
      options.light_samples[l] = samples[l];
      std::vector<core::Image> pictures;
      for (int seed = 1; seed <= kSeeds; ++seed) {
        options.seed = static_cast<std::uint64_t>(seed);
        pictures.push_back(core::LuminanceImage(Render().radiance));
      }
      const double spread = MeanSpread(pictures);
      double mean = 0, squares = 0;
      for (const double v : stated[l]) mean += v / kStated;
      for (const double v : stated[l]) squares += std::pow(v - mean, 2);
      const double error = std::sqrt(squares) / kStated;
      std::printf("%d passes, light %zu: stated over scatter %.3f +- %.3f\n", passes, l,
                  mean / spread, error / spread);
      // The scatter of few seeds besides, of some 20 pixels that hold most of the noise.
      EXPECT_NEAR(mean / spread, 1, 4 * std::hypot(error / spread, std::sqrt(2.0 / kSeeds / 20)));
      EXPECT_LT(error, 0.15 * spread);
    }
  }
}

}  // namespace
}  // namespace luxfield::render
