// Pictures by 1, 50 and 1000 lights: unbiased against exact sums, with no more samples than asked
// for, alone and beside area lights and an environment.
#include "luxfield/render/many_lights.h"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "luxfield/core/error.h"
#include "tests/render/renderer_fixture.h"
#include "tests/seed.h"

namespace luxfield::render {
namespace {

class ManyLightsTest : public RendererTest {};

constexpr std::array<core::Rgb, 3> kColours = {{{1.5, 0.5, 0.5}, {0.5, 1.5, 0.5}, {1, 1, 1}}};

// Lamps of two kinds at random places over the floor, tilted, of different strength and colour.
std::vector<scene::Luminaire> AnyLamps(int count, std::uint64_t seed) {
  const auto file = WriteLamp("many", Lamp(1)), other = WriteLamp("other", Lamp(3));
  core::Random random(seed, 0);
  std::vector<scene::Luminaire> lamps;
  for (int k = 0; k < count; ++k) {
    const double side = k == 0 ? 1 : 8;  // one alone is in sight
    const Vec3 at{side * (random.Uniform() - 0.5), side * (random.Uniform() - 0.5),
                  0.3 + 2 * random.Uniform()},
        to{at.x + random.Uniform() - 0.5, at.y + random.Uniform() - 0.5, 0};
    lamps.push_back({fmt::format("lamp {}", k),
                     k % 5 ? file : other,
                     {},
                     scene::LookAt(at, to, {0, 1, 0}),
                     0.1 + random.Uniform(),
                     kColours[k % 3]});
  }
  return lamps;
}

// An LM-63 file of one plane with candela at gamma = 0, 60 and 90.
std::filesystem::path WriteIntensity(const std::string& name,
                                     const std::array<double, 3>& candela) {
  const auto path = Temporary(name + ".ies");
  core::WriteFileAtomically(
      path,
      fmt::format("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 1\n0 60 90\n0\n{}\n",
                  fmt::join(candela, " ")));
  return path;
}

double SumOfIrradiance(const Frame& frame) {
  double sum = 0;
  for (const float e : frame.irradiance.data) sum += e;
  return sum;
}

// Means of runs of independent seeds against `expected`: t of every pixel and of the whole picture.
struct Spread {
  double whole = 0;                     // t
  double largest = 0, mean_square = 0;  // of t over pixels
};

Spread SpreadOf(const std::vector<Frame>& runs, const Frame& expected) {
  const auto n = static_cast<double>(runs.size());
  const auto t_of = [&](const auto& value, double truth) {
    double mean = 0, square = 0;
    for (const Frame& run : runs) mean += value(run) / n;
    for (const Frame& run : runs) square += std::pow(value(run) - mean, 2);
    return square > 0 ? (mean - truth) / std::sqrt(square / (n * (n - 1))) : 0;
  };
  Spread spread;
  spread.whole = t_of(SumOfIrradiance, SumOfIrradiance(expected));
  int pixels = 0;
  for (std::size_t k = 0; k < expected.coverage.data.size(); ++k) {
    if (!(expected.irradiance.plane(1)[k] > 0)) continue;
    const double t = t_of([&](const Frame& run) { return double{run.irradiance.plane(1)[k]}; },
                          expected.irradiance.plane(1)[k]);
    spread.largest = std::max(spread.largest, std::abs(t));
    spread.mean_square += t * t;
    ++pixels;
  }
  spread.mean_square /= pixels;
  return spread;
}

TEST_F(ManyLightsTest, AreUnbiased) {
  constexpr int kRuns = 32;
  const std::uint64_t seed = TestSeed(20260711);
  for (const auto& [count, estimator] : std::vector<std::pair<int, std::string>>{
           {1, "cells"}, {50, "cells"}, {50, "windowed"}, {1000, "cells"}}) {
    auto scene = Floor(AnyLamps(count, seed));
    scene.camera.width = 12;
    scene.camera.height = 8;
    LitScene lit(Device::Open(), scene);
    const Frame expected = Renderer(lit, Unshadowed("exact")).Render();
    RenderOptions options = Unshadowed(estimator);
    options.samples_per_pixel = 16;
    options.relight = false;
    std::vector<Frame> runs;
    double samples = 0, pixels = 0;
    for (int run = 0; run < kRuns; ++run) {
      options.seed = seed + static_cast<std::uint64_t>(run);
      runs.push_back(Renderer(lit, options).Render());
      for (std::size_t k = 0; k < expected.coverage.data.size(); ++k) {
        ASSERT_LE(runs.back().samples.data[k], 16);
        if (!(expected.irradiance.plane(1)[k] > 0)) continue;
        samples += runs.back().samples.data[k];
        ++pixels;
      }
    }
    const Spread spread = SpreadOf(runs, expected);
    std::printf("%d lamps, %s: t %.2f, largest %.2f, mean square %.2f, %.2f samples\n", count,
                estimator.c_str(), spread.whole, spread.largest, spread.mean_square,
                samples / pixels);
    EXPECT_LT(std::abs(spread.whole), 5) << count << estimator;
    EXPECT_LT(spread.largest, 7) << count << estimator;
    // Student's t of 31 degrees has the variance 31 / 29; the 96 pixels are independent.
    EXPECT_LT(spread.mean_square, 1.8) << count << estimator;
    // Some go to lamps that the tree cannot tell to be out of reach.
    EXPECT_GT(samples / pixels, 13) << count << estimator;
  }
}

TEST_F(ManyLightsTest, NoiseIsStated) {
  const std::uint64_t seed = TestSeed(20260712);
  const auto scene = Floor(AnyLamps(200, seed));
  LitScene lit(Device::Open(), scene);
  const Frame expected = Renderer(lit, Unshadowed("exact")).Render();
  RenderOptions options = Unshadowed("cells");
  options.samples_per_pixel = 32;
  double squares = 0, stated = 0;
  for (int run = 0; run < 8; ++run) {
    options.seed = seed + static_cast<std::uint64_t>(run);
    const Frame frame = Renderer(lit, options).Render();
    for (std::size_t k = 0; k < frame.variance.data.size(); ++k) {
      double difference = 0;
      const double weights[] = {0.2126, 0.7152, 0.0722};
      for (int c = 0; c < 3; ++c)
        difference += weights[c] * (frame.radiance.plane(c)[k] - expected.radiance.plane(c)[k]);
      squares += difference * difference;
      stated += frame.variance.data[k];
    }
  }
  std::printf("squared error over stated variance %.3f\n", squares / stated);
  // 8 pictures of 384 pixels, of which the relit draws measure the variance to some 10 % each.
  EXPECT_NEAR(squares / stated, 1, 0.25);
}

TEST_F(ManyLightsTest, LightsToldApartAddUp) {
  auto scene = Floor(AnyLamps(6, TestSeed(20260713)));
  RenderOptions options = Unshadowed("cells");
  options.samples_per_pixel = 5;
  options.lights_apart = options.light_groups = true;
  const Frame frame = RenderWith(scene, options);
  double sum = 0, of_groups = 0, whole = 0;
  for (const LightTotals& light : frame.lights) sum += light.mean_luminance;
  for (const LightGroup& group : frame.groups)
    for (const float e : group.irradiance.data) of_groups += e;
  const double weights[] = {0.2126, 0.7152, 0.0722};
  for (int c = 0; c < 3; ++c)
    for (const float l : frame.radiance.plane(c))
      whole += weights[c] * l / static_cast<double>(frame.coverage.plane_size());
  EXPECT_NEAR(sum, whole, 1e-5 * whole);
  EXPECT_NEAR(of_groups, SumOfIrradiance(frame), 1e-5 * of_groups);
}

// Lamps, rectangles, spheres and classical lights share the samples, with traced shadows.
TEST_F(ManyLightsTest, KindsOfLightsShareTheSamples) {
  constexpr int kRuns = 24;
  const std::uint64_t seed = TestSeed(20260714);
  auto scene = Floor(AnyLamps(5, seed));
  for (int k = 0; k < 9; ++k) {
    scene::AreaLight light;
    light.name = fmt::format("area {}", k);
    light.kind = k % 2 ? scene::AreaLightKind::kSphere : scene::AreaLightKind::kRectangle;
    light.radiance = {3, 2, 1};
    light.world_from_light =
        scene::LookAt({-2 + 0.5 * k, 1, 1.5}, {-2 + 0.5 * k, 0.5, 0}, {0, 1, 0});
    light.width_m = 0.3;
    light.height_m = light.radius_m = 0.2;
    scene.area_lights.push_back(light);
  }
  const auto spot = WriteIntensity("spot", {4, 3, 0}), even = WriteIntensity("even", {1, 1, 2});
  for (int k = 0; k < 6; ++k) {
    const auto model = std::array{scene::ClassicalModel::kPoint, scene::ClassicalModel::kLinear,
                                  scene::ClassicalModel::kArea}[k / 2];
    scene.classical_lights.push_back(
        {fmt::format("classical {}", k), model, k % 2 ? spot : even,
         std::array{0.4, model == scene::ClassicalModel::kArea ? 0.3 : 0.0},
         scene::LookAt({-1 + 0.5 * k, -1, 1.2}, {-1 + 0.5 * k, 0, 0}, {0, 1, 0}), 0.2,
         kColours[k % 3]});
  }
  AppendBox(scene::Translation({0.3, 0.2, 0.2}) * scene::Scaling({0.3, 0.4, 0.4}), 0,
            scene.geometry);
  scene.camera.width = 12;
  scene.camera.height = 8;
  LitScene lit(Device::Open(), scene);
  RenderOptions options;
  options.relight = false;
  options.light_samples.assign(20, 512);  // one by one
  const Frame expected = Renderer(lit, options).Render();
  options.light_samples.clear();
  options.samples_per_pixel = 8;
  std::vector<Frame> runs;
  for (int run = 0; run < kRuns; ++run) {
    options.seed = seed + static_cast<std::uint64_t>(run);
    runs.push_back(Renderer(lit, options).Render());
    for (const float samples : runs.back().samples.data) ASSERT_LE(samples, 8);
  }
  const Spread spread = SpreadOf(runs, expected);
  std::printf("kinds: t %.2f, largest %.2f, mean square %.2f\n", spread.whole, spread.largest,
              spread.mean_square);
  EXPECT_LT(std::abs(spread.whole), 5);
  EXPECT_LT(spread.largest, 7.5);
  EXPECT_LT(spread.mean_square, 1.8);
}

// Without noise lamps are left out of points where they do not matter: the sum of pictures of one
// lamp each, of which none is left out, says what that takes away.
TEST_F(ManyLightsTest, WhatIsLeftOutDoesNotMatter) {
  constexpr int kLamps = 40;
  const std::uint64_t seed = TestSeed(20260715);
  auto lamps = AnyLamps(kLamps, seed);
  // Half of them far away, as the lamps of a street are.
  for (int k = 0; k < kLamps; k += 2)
    lamps[k].world_from_luminaire =
        scene::Translation({30.0 * k, 0, 5}) * lamps[k].world_from_luminaire;
  const auto scene = Floor(lamps);
  const Device device = Device::Open();
  LitScene all(device, scene);
  for (const std::string estimator : {"exact", "volume", "gloss"}) {
    RenderOptions options = Unshadowed(estimator);
    const Frame together = Renderer(all, options).Render();
    std::vector<double> sum(together.irradiance.data.size(), 0.0);
    for (const scene::Luminaire& lamp : lamps) {
      LitScene one(device, Floor({lamp}));
      const Frame frame = Renderer(one, Unshadowed("exact")).Render();
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += frame.irradiance.data[k];
    }
    double mean = 0, worst = 0, squares = 0;
    for (const double e : sum) mean += e / static_cast<double>(sum.size());
    for (std::size_t k = 0; k < sum.size(); ++k) {
      const double difference = std::abs(together.irradiance.data[k] - sum[k]);
      worst = std::max(worst, difference / (mean + sum[k]));
      squares += difference * difference / static_cast<double>(sum.size());
    }
    std::printf("%s: worst %.3g, rms %.3g of the mean\n", estimator.c_str(), worst,
                std::sqrt(squares) / mean);
    if (estimator == "volume") {
      EXPECT_LT(std::sqrt(squares) / mean, 1.2 * options.approximation_error);
    } else {
      EXPECT_LT(worst, 2e-5);  // the estimator's bound, twice
    }
  }
}

TEST_F(ManyLightsTest, TooFewSamplesAreRefused) {
  LitScene lit(Device::Open(), Floor(AnyLamps(3, 1)));
  RenderOptions options = Unshadowed("cells");
  options.samples_per_pixel = 7;
  options.antialias = 8;
  try {
    Renderer(lit, options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("must be at least 8"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace luxfield::render
