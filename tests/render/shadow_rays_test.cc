// Shadow rays that are drawn, traced and added up in batches, against light that meets nothing.
#include "luxfield/render/estimators/shadow_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "luxfield/render/estimators/environment.h"
#include "tests/render/area_light_fixture.h"
#include "tests/render/brdf_by_formula.h"
#include "tests/render/environment_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

// At this many samples a batch of a CPU device holds less than kPixels pixels.
constexpr int kManySamples = 3000, kPixels = 60;

constexpr char kNewton[] = "newton";

// A light on a G-buffer.
using LightPixels = std::function<Lit(const GBuffer&, int samples, const RayScene*)>;

struct Lights {
  explicit Lights(const Device& device)
      : luminaire(device, StructuredLuminaire("facets", {}, kSamplingSeed)),
        map(device, NoiseMap(12).face_size),
        mis(device),
        environment(device) {
    map.Show(NoiseMap(12));
  }

  LitLuminaire luminaire;
  EnvironmentLight map;
  MisEstimator mis;
  EnvironmentEstimator environment;
  std::map<std::string, std::unique_ptr<Estimator>> samplers;
};

std::vector<std::pair<std::string, LightPixels>> AllLights(const Device& device, Lights& lights) {
  std::vector<std::pair<std::string, LightPixels>> all;
  for (const char* name : {"windowed", "cells", "precomputed", "thesis"}) {
    lights.samplers[name] = MakeEstimator(name, device);
    all.emplace_back(name, [&, name](const GBuffer& gbuffer, int samples, const RayScene* rays) {
      EstimatorOptions options;
      options.samples_per_pixel = samples;
      return LightGBuffer(device, *lights.samplers[name], gbuffer, lights.luminaire.on_device,
                          options, rays);
    });
  }
  const std::vector<std::pair<std::string, Strategies>> by{{"power", Strategies::kPower},
                                                           {kNewton, Strategies::kNewton}};
  for (const auto& [name, strategies] : by) {
    const auto options_of = [strategies = strategies](int samples) {
      return WithStrategies(strategies, samples);
    };
    all.emplace_back(name + " of a luminaire",
                     [&, options_of](const GBuffer& gbuffer, int samples, const RayScene* rays) {
                       return LightGBuffer(device, lights.mis, gbuffer, lights.luminaire.on_device,
                                           options_of(samples), rays);
                     });
    all.emplace_back(name + " of a rectangle",
                     [&, options_of](const GBuffer& gbuffer, int samples, const RayScene* rays) {
                       return LightByArea(device, lights.mis, gbuffer, Rectangle(0.3, 0.2, {}),
                                          options_of(samples), rays);
                     });
  }
  all.emplace_back("environment", [&](const GBuffer& gbuffer, int samples, const RayScene* rays) {
    EstimatorOptions options;
    options.samples_per_pixel = samples;
    return LightByEnvironment(device, lights.environment, gbuffer, lights.map, options, rays);
  });
  return all;
}

GBuffer GlossyPixels(const Device& device, const std::vector<SurfacePoint>& points) {
  GBuffer gbuffer = MakeGBuffer(device, points, true);
  gbuffer.eye = {{0.5f, 0, 0.2f, 1}};
  const TestBrdf brdf = TestBrdf::Phong({0.3, 0.2, 0.2}, {0.5, 0.4, 0.3}, 40);
  gbuffer.albedo.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.size(), brdf.AlbedoTexel())));
  gbuffer.gloss.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.size(), brdf.GlossTexel())));
  return gbuffer;
}

bool Same(const cl_float4& a, const cl_float4& b, float relative) {
  for (int c = 0; c < 3; ++c)
    if (!(std::abs(a.s[c] - b.s[c]) <= relative * std::abs(b.s[c]))) return false;
  return true;
}

// Pixels whose light differs by more than `relative`.
int Differing(const Lit& a, const Lit& b, float relative) {
  int count = 0;
  for (std::size_t k = 0; k < a.irradiance.size(); ++k) {
    EXPECT_EQ(a.samples[k], b.samples[k]) << k;
    count += !Same(a.irradiance[k], b.irradiance[k], relative) ||
             (!a.reflected.empty() && !Same(a.reflected[k], b.reflected[k], relative)) ||
             !(std::abs(a.variance[k] - b.variance[k]) <= 1e-4f * b.variance[k]);
  }
  return count;
}

// Where nothing is in the way the traced sum is the sum of the same samples in the same order, few
// or many of them, of pixels that come in several batches.
TEST(ShadowRays, RaysThatMeetNothingChangeNothing) {
  const Device device = Device::Open();
  Lights lights(device);
  const auto points = FacingReceivers(0.3, kPixels, 0.5, 2);
  const auto clear = Blocker(device, 1e5, 1e5 + 1, 0.1);  // 1e-9 of the sky
  ShadowRays batches(device);
  batches.Start(clear.get(), false, kManySamples, kPixels);
  if (device.info().is_cpu) {
    ASSERT_LT(batches.pixels_at_once(), std::size_t{kPixels});
  }
  const GBuffer lambertian = MakeGBuffer(device, points), glossy = GlossyPixels(device, points);
  for (const auto& [name, light] : AllLights(device, lights))
    for (const int samples : {8, kManySamples})
      for (const GBuffer* gbuffer : {&lambertian, &glossy}) {
        SCOPED_TRACE(name + ", " + std::to_string(samples) + " samples");
        // A share chosen by a pilot's luminances follows how their sums are rounded.
        const float relative = name.starts_with(kNewton) ? 1e-5f : 0;
        EXPECT_EQ(Differing(light(*gbuffer, samples, clear.get()),
                            light(*gbuffer, samples, nullptr), relative),
                  0);
      }
}

// Kernels and the host see the same half of the light, but for rays through the blocker's edge.
TEST(ShadowRays, HostAndKernelHideTheSame) {
  const Device device = Device::Open();
  DeviceTuning tuning = device.tuning();
  tuning.host_rays = !tuning.host_rays;
  Lights lights(device);
  const GBuffer gbuffer = MakeGBuffer(device, FacingReceivers(0.3, kPixels, 0.5, 2));
  const auto half = Blocker(device, 0, 10, 1e-4),
             other = Blocker(device.WithTuning(tuning), 0, 10, 1e-4);
  for (const auto& [name, light] : AllLights(device, lights)) {
    SCOPED_TRACE(name);
    const Lit hidden = light(gbuffer, 64, half.get()), open = light(gbuffer, 64, nullptr);
    EXPECT_LE(Differing(hidden, light(gbuffer, 64, other.get()), 1e-5f), kPixels / 20);
    int darker = 0;
    for (int k = 0; k < kPixels; ++k) darker += hidden.irradiance[k].s[0] < open.irradiance[k].s[0];
    EXPECT_GT(darker, kPixels / 4);
  }
}

// A pixel of more samples than a batch is meant to hold is a batch of its own.
TEST(ShadowRays, BatchesHoldAtLeastAPixel) {
  const Device device = Device::Open();
  const auto blocker = Blocker(device, 0, 10, 0.1);
  ShadowRays shadow(device);
  shadow.Start(blocker.get(), true, std::size_t{1} << 20, 5);
  EXPECT_GE(shadow.pixels_at_once(), 1u);
  shadow.Start(nullptr, true, std::size_t{1} << 20, 5);
  EXPECT_EQ(shadow.pixels_at_once(), 5u);
  EXPECT_FALSE(shadow.traced());
}

}  // namespace
}  // namespace luxfield::render
