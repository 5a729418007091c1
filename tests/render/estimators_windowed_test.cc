// `windowed` is unbiased and bounded on images where `thesis` is biased; shadows, streams,
// extremes.
#include "render/estimators/windowed.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "core/error.h"
#include "lightfield/light_vector.h"
#include "render/estimators/luminaire_params.h"
#include "render/kernels/brdf_types.clh"
#include "render/kernels/sampling_types.clh"
#include "tests/render/estimator_fixture.h"
#include "tests/render/sampling_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {
namespace {

using lightfield::BasisKind;
using lightfield::Vec3;

TEST(Windowed, IsUnbiasedWhereThesisIsNot) {
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSamplingSeed));
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device), thesis = MakeEstimator("thesis", device);
  const auto points = FacingReceivers(0.3, 128);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const char* kind : {"rings", "facets", "filament"})
    for (const int images : {1, 3}) {
      LuminaireShape shape;
      shape.grid_width = shape.grid_height = images;
      const LitLuminaire luminaire(device, StructuredLuminaire(kind, shape, kSamplingSeed));
      const auto exact = ExactLuminance(luminaire.field, points);
      EstimatorOptions options;
      options.samples_per_pixel = 48;
      const std::string what =
          std::string(kind) + ", " + std::to_string(images * images) + " images";
      ExpectUnbiased(OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 64), exact,
                     64, what.c_str());

      // The printed estimator at its limit: what is left is bias.
      options.samples_per_pixel = 20000;
      const Lit limit = LightGBuffer(device, *thesis, gbuffer, luminaire.on_device, options);
      double square = 0, mean = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        square += std::pow(Luminance(limit.irradiance[k]) - exact[k], 2) / 128;
        mean += exact[k] / 128;
      }
      const double bias = std::sqrt(square) / mean;
      std::printf("%s: thesis is off by %.0f %% rms of the mean, at 20000 samples\n", what.c_str(),
                  100 * bias);
      EXPECT_GT(bias, 0.05) << what;
    }
}

TEST(Windowed, AllBasesColourAndBoundedImages) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const auto points = FacingReceivers(0.3, 40);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const BasisKind kind :
       {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic, BasisKind::kBspline2})
    for (const float bound : {0.0f, 1.5f}) {
      LuminaireShape shape;
      shape.basis = lightfield::Basis::Make(kind);
      shape.channels = 3;
      const LitLuminaire luminaire(device, StructuredLuminaire("facets", shape, kSamplingSeed));
      EstimatorOptions options;
      options.samples_per_pixel = 32;
      options.max_samples_per_image = bound;
      const std::string what = shape.basis.name() + (bound > 0 ? ", K_max" : "");
      ExpectUnbiased(OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 64),
                     ExactLuminance(luminaire.field, points), 64, what.c_str());
    }
}

TEST(Windowed, ExtremeReceiversAndWindows) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  for (const double delta : {0.001, 0.25, 10.0})
    for (const int texels : {1, 3, 40}) {
      LuminaireShape shape;
      shape.delta_m = delta;
      shape.width = texels;
      shape.height = texels;
      const LitLuminaire luminaire(device, StructuredLuminaire("grain", shape, kSamplingSeed));
      std::vector<SurfacePoint> points;
      for (const double D :
           {0.0, 1e-9, 1e-6, 1e-3, 0.1, 100.0, 1e6, -0.01 * delta, -0.5 * delta, -0.9 * delta})
        for (const double x : {0.0, 0.013, -0.037, 3.0})
          points.push_back(
              RoundToFloat({{x, 0.5 * x + 0.001, delta + D}, Normalized(Vec3{0.1, 0.2, -1})}));
      const GBuffer gbuffer = MakeGBuffer(device, points);
      const auto exact = ExactLuminance(luminaire.field, points);
      for (const int samples : {1, 64}) {
        EstimatorOptions options;
        options.samples_per_pixel = samples;
        const auto statistics =
            OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 256);
        const std::string what = "delta " + std::to_string(delta) + ", " + std::to_string(texels) +
                                 " texels, K " + std::to_string(samples);
        ExpectUnbiased(statistics, exact, 256, what.c_str());
      }
    }
}

TEST(Windowed, TakesExactlyKSamplesAndNoneInTheDark) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  LuminaireShape shape;
  const LitLuminaire luminaire(device, StructuredLuminaire("noise", shape, kSamplingSeed));
  auto points = FacingReceivers(0.3, 60);
  points.push_back({{0, 0, -1}, {0, 0, 1}});    // behind
  points.push_back({{500, 0, 1}, {-1, 0, 0}});  // every window off the image
  for (const int samples : {1, 7, 200}) {
    EstimatorOptions options;
    options.samples_per_pixel = samples;
    const Lit lit =
        LightGBuffer(device, *windowed, MakeGBuffer(device, points), luminaire.on_device, options);
    for (int k = 0; k < 60; ++k) EXPECT_EQ(lit.samples[k], static_cast<cl_uint>(samples)) << k;
    for (int k = 60; k < 62; ++k) {
      EXPECT_EQ(lit.samples[k], 0u);
      EXPECT_EQ(lit.irradiance[k].s[0], 0);
    }
  }
}

TEST(Windowed, ContributionsAreBounded) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  LuminaireShape shape;
  const LitLuminaire luminaire(device, StructuredLuminaire("noise", shape, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 50);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto& g = luminaire.field.geometry;
  for (int seed = 0; seed < 100; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = 1;
    options.seed = kSamplingSeed + seed;
    const Lit lit = LightGBuffer(device, *windowed, gbuffer, luminaire.on_device, options);
    for (std::size_t k = 0; k < points.size(); ++k) {
      // A (integral of C over the windows, on F) times the largest Phi |u - p| delta^2 / z^3; A <=
      // max C * supports.
      const Vec3 p = points[k].p;
      const double half = 0.5 * (shape.grid_width + 2) * shape.spacing_m;
      const double far = lightfield::Length({std::abs(p.x) + half, std::abs(p.y) + half, p.z});
      const double area = g.grid.count() * 9 * shape.spacing_m * shape.spacing_m;
      const double bound = 1.5 * area * 0.5625 * far * g.delta_m * g.delta_m / std::pow(p.z, 3);
      EXPECT_LE(lit.irradiance[k].s[0], bound);
    }
  }
}

TEST(Windowed, ReportedVarianceCoversTheScatter) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("facets", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 60);
  EstimatorOptions options;
  options.samples_per_pixel = 64;
  const auto statistics =
      OverSeeds(device, *windowed, MakeGBuffer(device, points), luminaire.on_device, options, 64);
  double scatter = 0, reported = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    scatter +=
        64 * std::pow(statistics.standard_error[k], 2) / statistics.reported_variance[k] / 60;
    reported += statistics.reported_variance[k];
  }
  std::printf("scatter / reported variance: %.2f\n", scatter);
  EXPECT_GT(reported, 0);
  EXPECT_LT(scatter, 1.1);
  EXPECT_GT(scatter, 0.05);
}

TEST(Windowed, StreamsSeedsAndTilesAreWhatTheySay) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 96);
  EstimatorOptions options;
  options.samples_per_pixel = 16;
  const auto run = [&](const std::vector<SurfacePoint>& some) {
    return LightGBuffer(device, *windowed, MakeGBuffer(device, some), luminaire.on_device, options)
        .irradiance;
  };
  const auto whole = run(points);
  const auto same = [](const cl_float4& a, const cl_float4& b) { return a.s[0] == b.s[0]; };
  options.first_pixel = 40;
  const auto tile = run({points.begin() + 40, points.end()});
  for (std::size_t k = 0; k < tile.size(); ++k) EXPECT_TRUE(same(tile[k], whole[k + 40])) << k;
  options.first_pixel = 0;
  EXPECT_TRUE(std::equal(whole.begin(), whole.end(), run(points).begin(), same));
  options.stream = 1;
  EXPECT_FALSE(std::equal(whole.begin(), whole.end(), run(points).begin(), same));
  options.stream = 0;
  options.seed += std::uint64_t{1} << 40;
  EXPECT_FALSE(std::equal(whole.begin(), whole.end(), run(points).begin(), same));
}

TEST(Windowed, WorkGroupSizeDoesNotMatter) {
  const Device device = Device::Open();
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 100);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto& grid = luminaire.field.geometry.grid;
  const auto params =
      MakeLuminaireParams(luminaire.field.geometry, luminaire.on_device.row_stride(), {});
  SamplingParams sampling{};
  sampling.samples = 20;
  sampling.seed_lo = 5;
  sampling.end = 100;
  sampling.scratch_stride = 128;
  const Program windows = Program::Build(device, "kernels/window_masses.cl"),
                program = Program::Build(device, "kernels/windowed.cl");
  const Buffer none,
      device_params = Buffer::From(device, std::span<const LuminaireParams>(&params, 1)),
      device_sampling = Buffer::From(device, std::span<const SamplingParams>(&sampling, 1));
  const std::size_t axes = grid.width + grid.height, rows = grid.height;
  std::vector<cl_float4> first;
  for (const std::size_t group : {1, 7, 64, 128}) {
    const Buffer spans(device, 128 * axes * sizeof(cl_int4)),
        masses(device, 128 * sizeof(float) * luminaire.tables.count());
    Lighting lighting(device, gbuffer);
    Kernel(windows, "WindowSpans")
        .Set(device_params, device_sampling, gbuffer.position, spans)
        .Enqueue({100, 2}, {group});
    Kernel(windows, "WindowMasses")
        .Set(device_params, device_sampling, luminaire.on_device.sat(),
             luminaire.on_device.sat_scale(), none, spans, masses)
        .Enqueue({100, rows}, {group});
    Kernel(program, "Windowed")
        .Set(device_params, device_sampling, luminaire.on_device.images(),
             luminaire.on_device.sat(), luminaire.on_device.sat_scale(), gbuffer.position,
             gbuffer.normal, gbuffer.albedo, gbuffer.gloss, gbuffer.eye, none, none, none, spans,
             masses, lighting.irradiance, lighting.reflected, lighting.variance, lighting.samples)
        .Enqueue({100}, {group});
    const auto result = lighting.irradiance.Download<cl_float4>();
    if (first.empty()) first = result;
    for (int k = 0; k < 100; ++k) {
      EXPECT_GT(result[k].s[1], 0) << k;
      EXPECT_EQ(result[k].s[1], first[k].s[1]) << group;
    }
  }
}

// More pixels than one batch of scratch memory takes: their light is that of a tile of their own.
TEST(Windowed, BatchesDoNotMatter) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  LuminaireShape shape;
  shape.grid_width = shape.grid_height = 7;
  shape.width = shape.height = 8;
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", shape, kSamplingSeed));
  constexpr std::size_t kPixels = 24000, kTail = 500;
  const auto some = FacingReceivers(0.3, kTail);
  std::vector<SurfacePoint> points;
  while (points.size() < kPixels) points.insert(points.end(), some.begin(), some.end());
  EstimatorOptions options;
  options.samples_per_pixel = 1;
  const auto whole =
      LightGBuffer(device, *windowed, MakeGBuffer(device, points), luminaire.on_device, options);
  options.first_pixel = kPixels - kTail;
  const auto tail =
      LightGBuffer(device, *windowed, MakeGBuffer(device, some), luminaire.on_device, options);
  for (std::size_t k = 0; k < kTail; ++k)
    EXPECT_EQ(tail.irradiance[k].s[0], whole.irradiance[kPixels - kTail + k].s[0]) << k;
}

// In a glossy G-buffer a Lambertian surface shows albedo / pi times its irradiance, and the
// variance is that of what it shows.
TEST(Windowed, LambertianSurfacesOfAGlossyGBufferShowTheirAlbedo) {
  const Device device = Device::Open();
  const LitLuminaire luminaire(device, StructuredLuminaire("facets", {}, kSamplingSeed));
  const auto windowed = MakeEstimator("windowed", device);
  const auto points = FacingReceivers(0.3, 50);
  const GBuffer diffuse = MakeGBuffer(device, points);
  GBuffer glossy(device, diffuse.width, 1, true);
  glossy.position = Buffer::From(device, diffuse.position.Download<cl_float4>());
  glossy.normal = Buffer::From(device, diffuse.normal.Download<cl_float4>());
  const cl_float4 albedo{{0.25f, 0.5f, 0.75f, kLambert}};
  glossy.albedo.Upload(std::span<const cl_float4>(std::vector<cl_float4>(points.size(), albedo)));
  glossy.gloss.FillZero();
  glossy.eye = {{0, 1, 5, 0}};
  Lighting plain(device, diffuse), shown(device, glossy);
  windowed->Light(diffuse, {}, luminaire.on_device, {}, {}, plain);
  windowed->Light(glossy, {}, luminaire.on_device, {}, {}, shown);
  const auto e = plain.irradiance.Download<cl_float4>(), l = shown.reflected.Download<cl_float4>();
  const auto variance_e = plain.variance.Download<float>(),
             variance_l = shown.variance.Download<float>();
  for (std::size_t k = 0; k < points.size(); ++k) {
    ASSERT_GT(e[k].s[0], 0);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(l[k].s[c] * std::numbers::pi / albedo.s[c], e[k].s[c], 1e-5 * e[k].s[c]);
    // A one-channel lamp is white: the luminance of the albedo scales its variance.
    const double y = 0.2126 * albedo.s[0] + 0.7152 * albedo.s[1] + 0.0722 * albedo.s[2];
    EXPECT_NEAR(variance_l[k], variance_e[k] * y * y / (std::numbers::pi * std::numbers::pi),
                1e-3 * variance_l[k]);
  }
}

TEST(Windowed, ShadowsBlockAllNoneOrPart) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device), exact = MakeEstimator("exact", device);
  LuminaireShape shape;
  const LitLuminaire luminaire(device, StructuredLuminaire("facets", shape, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 64, 0.5, 2);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  EstimatorOptions options;
  options.samples_per_pixel = 64;
  const DeviceBvh all = Blocker(device, -10, 10, 0.1f), none = Blocker(device, 20, 30, 0.1f);
  for (Estimator* estimator : {windowed.get(), exact.get()}) {
    const auto open = LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options);
    const auto dark = LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options, &all);
    const auto clear =
        LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options, &none);
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_GT(open.irradiance[k].s[0], 0);
      EXPECT_EQ(dark.irradiance[k].s[0], 0);
      EXPECT_EQ(clear.irradiance[k].s[0], open.irradiance[k].s[0]);
    }
  }

  // A blocker on F's half-space x > 0: what is left is the light of the clipped basis, by
  // quadrature over u.
  const DeviceBvh half = Blocker(device, 0, 10, 1e-4f);
  std::vector<double> judge;
  constexpr int kNodes = 240;
  for (const auto& [p, n] : points) {
    double sum = 0;
    const auto& g = luminaire.field.geometry;
    for (int a = 0; a < kNodes; ++a)
      for (int b = 0; b < kNodes; ++b) {
        const double u0 = g.grid.u0_m, v0 = g.grid.v0_m;
        // u from u0 up to where the ray from p passes the blocker's edge (x = 0 at z = 1e-4).
        const double edge = -p.x * 1e-4 / (p.z - 1e-4),
                     v1 = v0 + (shape.grid_height + 2) * shape.spacing_m;
        const lightfield::Vec2 u{u0 + (edge - u0) * (a + 0.5) / kNodes,
                                 v0 + (v1 - v0) * (b + 0.5) / kNodes};
        const lightfield::Vec2 s{(u.x * (p.z - g.delta_m) + p.x * g.delta_m) / p.z,
                                 (u.y * (p.z - g.delta_m) + p.y * g.delta_m) / p.z};
        const Vec3 to_lamp{u.x - p.x, u.y - p.y, -p.z};
        sum += lightfield::FluxDensity(luminaire.field, u, s)[0] * std::max(0.0, Dot(n, to_lamp)) *
               (edge - u0) * (v1 - v0) / (kNodes * kNodes);
      }
    judge.push_back(sum * g.delta_m * g.delta_m / std::pow(p.z, 3));
  }
  const auto statistics =
      OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 64, &half);
  ExpectUnbiased(statistics, judge, 64, "half blocked");
  // `exact` with shadows is a ratio: consistent, its bias falls with K.
  options.samples_per_pixel = 4000;
  const auto lit = LightGBuffer(device, *exact, gbuffer, luminaire.on_device, options, &half);
  double square = 0, mean = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    square += std::pow(lit.irradiance[k].s[0] - judge[k], 2) / 64;
    mean += judge[k] / 64;
    EXPECT_EQ(lit.samples[k], 4000u);
    EXPECT_LT(std::abs(lit.irradiance[k].s[0] - judge[k]),
              5 * std::sqrt(lit.variance[k]) + 1e-3 * judge[k]);
  }
  std::printf("exact with shadows: relative RMSE %.2e at 4000 samples\n", std::sqrt(square) / mean);
  EXPECT_LT(std::sqrt(square), 0.02 * mean);
}

TEST(Windowed, BadOptionsAndMissingTablesAreRefused) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", {}, kSamplingSeed));
  const LuminaireOnDevice bare(device, luminaire.field);
  const GBuffer gbuffer = MakeGBuffer(device, FacingReceivers(0.3, 2));
  EstimatorOptions options;
  EXPECT_THROW(LightGBuffer(device, *windowed, gbuffer, bare, options), InputError);
  options.samples_per_pixel = 0;
  EXPECT_THROW(LightGBuffer(device, *windowed, gbuffer, luminaire.on_device, options), InputError);
  options.samples_per_pixel = 8;
  options.max_samples_per_image = -1;
  EXPECT_THROW(LightGBuffer(device, *windowed, gbuffer, luminaire.on_device, options), InputError);
  EXPECT_THROW(MakeEstimator("precise", device), InputError);
  for (const auto& traits : EstimatorList())
    EXPECT_EQ(MakeEstimator(traits.name, device)->traits().name, traits.name);
}

}  // namespace
}  // namespace luxfield::render
