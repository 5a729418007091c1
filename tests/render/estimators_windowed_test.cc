// `windowed` is unbiased and bounded on images where `thesis` is biased; shadows, extremes.
#include "luxfield/render/estimators/sampling_estimators.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/kernels/brdf/brdf_types.clh"
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
      // A (integral of C over the windows, on F) times the largest Phi |u - p| delta^2 / z^3;
      // A <= max C * supports.
      const Vec3 p = points[k].p;
      const double half = 0.5 * (shape.grid_width + 2) * shape.spacing_m;
      const double far = lightfield::Length({std::abs(p.x) + half, std::abs(p.y) + half, p.z});
      const double area = g.grid.count() * 9 * shape.spacing_m * shape.spacing_m;
      const double bound = 1.5 * area * 0.5625 * far * g.delta_m * g.delta_m / std::pow(p.z, 3);
      EXPECT_LE(lit.irradiance[k].s[0], bound);
    }
  }
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
  windowed->Light({diffuse}, PosedLuminaire{luminaire.on_device}, {}, plain);
  windowed->Light({glossy}, PosedLuminaire{luminaire.on_device}, {}, shown);
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
  const auto all = Blocker(device, -10, 10, 0.1f), none = Blocker(device, 20, 30, 0.1f);
  for (Estimator* estimator : {windowed.get(), exact.get()}) {
    const auto open = LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options);
    const auto dark =
        LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options, all.get());
    const auto clear =
        LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options, none.get());
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_GT(open.irradiance[k].s[0], 0);
      EXPECT_EQ(dark.irradiance[k].s[0], 0);
      EXPECT_EQ(clear.irradiance[k].s[0], open.irradiance[k].s[0]);
    }
  }

  // A blocker on F's half-space x > 0: what is left is the light of the clipped basis, by
  // quadrature over u.
  const auto half = Blocker(device, 0, 10, 1e-4f);
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
      OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 64, half.get());
  ExpectUnbiased(statistics, judge, 64, "half blocked");
  // `exact` with shadows is a ratio: consistent, its bias falls with K.
  options.samples_per_pixel = 4000;
  const auto lit = LightGBuffer(device, *exact, gbuffer, luminaire.on_device, options, half.get());
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

}  // namespace
}  // namespace luxfield::render
