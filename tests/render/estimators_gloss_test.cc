// `gloss`, and `windowed` on glossy surfaces, against brute-force quadrature in double.
#include "luxfield/render/estimators/gloss.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_vector.h"
#include "luxfield/render/scene/device_scene.h"
#include "tests/render/brdf_by_formula.h"
#include "tests/render/brute_force.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;

constexpr std::uint64_t kSeed = 20140303;

// Receivers that see the lamp mirrored, more or less, in one eye at a distance: each normal halves
// the angle between the eye and a point of the lamp, turned by up to `tilt` rad.
struct GlossyPoints {
  std::vector<SurfacePoint> points;
  Vec3 eye{0.7, -1.5, 0.9};
};

GlossyPoints MirroringReceivers(double delta, int count, double tilt, double near = 0.3,
                                double far = 4) {
  core::Random random(kSeed, 4);
  GlossyPoints out;
  for (int k = 0; k < count; ++k) {
    const double D = near * std::pow(far / near, random.Uniform());
    const Vec3 p{0.25 * (delta + D) * (random.Uniform() - 0.5),
                 0.25 * (delta + D) * (random.Uniform() - 0.5), delta + D};
    const Vec3 u{0.05 * (random.Uniform() - 0.5), 0.03 * (random.Uniform() - 0.5), 0};
    const Vec3 half = Normalized(u - p) + Normalized(out.eye - p);
    const Vec3 turn{random.Normal(), random.Normal(), random.Normal()};
    out.points.push_back(RoundToFloat({p, Normalized(Normalized(half) + tilt * Normalized(turn))}));
  }
  return out;
}

GBuffer MakeGlossyGBuffer(const Device& device, const GlossyPoints& points, const TestBrdf& brdf) {
  GBuffer gbuffer = MakeGBuffer(device, points.points, true);
  gbuffer.albedo.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.points.size(), brdf.AlbedoTexel())));
  gbuffer.gloss.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.points.size(), brdf.GlossTexel())));
  gbuffer.eye = {{static_cast<float>(points.eye.x), static_cast<float>(points.eye.y),
                  static_cast<float>(points.eye.z), 1}};
  return gbuffer;
}

// Radiance of channel 0; the eye as the device sees it.
std::vector<double> Judge(const lightfield::LightField& field, const GlossyPoints& points,
                          const TestBrdf& brdf, int splits) {
  const Vec3 eye = RoundToFloat({points.eye, {0, 0, 1}}).p;
  std::vector<double> radiance;
  for (const auto& [p, n] : points.points) {
    const Vec3 to_eye = Normalized(eye - p);
    radiance.push_back(BruteForceRadiance(
        field, p, n, splits, [&](Vec3 w) { return BrdfByFormula(brdf, n, to_eye, w)[0]; }));
  }
  return radiance;
}

double RelativeRms(const std::vector<cl_float4>& values, const std::vector<double>& judge) {
  double square = 0, mean = 0;
  for (std::size_t k = 0; k < judge.size(); ++k) {
    square += std::pow(values[k].s[0] - judge[k], 2);
    mean += judge[k];
  }
  return std::sqrt(square * static_cast<double>(judge.size())) / mean;
}

struct NamedBrdf {
  std::string name;
  TestBrdf brdf;
  // Of the judge: 1.5e-5 or less of it changes from splits - 1 to splits (measured).
  int splits;
  float finest;  // error that may be asked for: 32 parts of a cell resolve no narrower lobe
};

std::vector<NamedBrdf> Lobes() {
  const std::array<double, 3> diffuse{0.2, 0.2, 0.2}, specular{0.6, 0.6, 0.6},
      copper{0.9, 0.6, 0.3}, grey{0.5, 0.5, 0.5};
  return {{"phong 32", TestBrdf::Phong(diffuse, specular, 32), 1, 2e-4f},
          {"phong 256", TestBrdf::Phong(diffuse, specular, 256), 1, 2e-4f},
          {"phong 1024", TestBrdf::Phong(diffuse, specular, 1024), 2, 2e-4f},
          {"phong 4096", TestBrdf::Phong(diffuse, specular, 4096), 2, 1e-3f},
          {"ggx metal 0.05", TestBrdf::Ggx(copper, 1, 0.05), 8, 1e-2f},
          {"ggx metal 0.1", TestBrdf::Ggx(copper, 1, 0.1), 3, 1e-3f},
          {"ggx metal 0.2", TestBrdf::Ggx(copper, 1, 0.2), 2, 2e-4f},
          {"ggx metal 0.4", TestBrdf::Ggx(copper, 1, 0.4), 1, 2e-4f},
          {"ggx metal 1", TestBrdf::Ggx(copper, 1, 1), 1, 2e-4f},
          {"ggx dielectric 0.2", TestBrdf::Ggx(grey, 0, 0.2), 2, 2e-4f}};
}

LuminaireShape SmallLamp() {
  LuminaireShape shape;
  shape.width = 37;
  shape.height = 29;
  return shape;
}

TEST(Gloss, MeetsTheErrorAskedFor) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  const auto points = MirroringReceivers(0.3, 20, 0.03);
  const auto field = StructuredLuminaire("facets", SmallLamp(), kSeed);
  const LuminaireOnDevice luminaire(device, field);
  for (const auto& [name, brdf, splits, finest] : Lobes()) {
    const GBuffer gbuffer = MakeGlossyGBuffer(device, points, brdf);
    const auto judge = Judge(field, points, brdf, splits);
    std::printf("%s:", name.c_str());
    for (const float asked : {1e-2f, 1e-3f, 2e-4f}) {
      if (asked < finest) continue;
      EstimatorOptions options;
      options.max_error = asked;
      const Lit lit = LightGBuffer(device, *gloss, gbuffer, luminaire, options);
      const double error = RelativeRms(lit.reflected, judge);
      std::printf("  asked %.0e got %.1e", asked, error);
      EXPECT_LT(error, asked) << name;
      for (std::size_t k = 0; k < judge.size(); ++k) {
        EXPECT_EQ(lit.variance[k], 0);
        EXPECT_EQ(lit.samples[k], 0u);
      }
    }
    std::printf("\n");
  }
}

// Blocks of images stand for cells where lobes are broad: each pixel keeps the error asked for, on
// the lobe and beside it, and blocks are what it comes from, as cells would err far less.
TEST(Gloss, BlocksOfImagesKeepTheErrorAtEachPixel) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  LuminaireShape shape = SmallLamp();
  shape.channels = 3;
  const LuminaireOnDevice luminaire(device, StructuredLuminaire("facets", shape, kSeed));
  for (const auto& [name, brdf] :
       {std::pair{"phong 16", TestBrdf::Phong({0.1, 0.2, 0.3}, {0.6, 0.6, 0.6}, 16)},
        std::pair{"ggx metal 0.5", TestBrdf::Ggx({0.9, 0.6, 0.3}, 1, 0.5)},
        std::pair{"ggx metal 0.3", TestBrdf::Ggx({0.9, 0.6, 0.3}, 1, 0.3)},
        std::pair{"ggx dielectric 0.4", TestBrdf::Ggx({0.5, 0.5, 0.5}, 0, 0.4)}})
    for (const double tilt : {0.02, 0.4}) {
      const GBuffer gbuffer =
          MakeGlossyGBuffer(device, MirroringReceivers(0.3, 200, tilt, 0.1, 8), brdf);
      EstimatorOptions options;
      options.max_error = 1e-4f;
      const Lit fine = LightGBuffer(device, *gloss, gbuffer, luminaire, options);
      for (const float asked : {1e-2f, 3e-2f}) {
        options.max_error = asked;
        const Lit lit = LightGBuffer(device, *gloss, gbuffer, luminaire, options);
        double largest = 0, squares = 0;
        for (std::size_t k = 0; k < lit.reflected.size(); ++k)
          for (int c = 0; c < 3; ++c) {
            const double shown = fine.reflected[k].s[c];
            if (!(shown > 0)) continue;
            const double error = std::abs(lit.reflected[k].s[c] / shown - 1);
            largest = std::max(largest, error);
            squares += error * error;
          }
        const double rms = std::sqrt(squares / (3.0 * static_cast<double>(lit.reflected.size())));
        std::printf("%s, tilt %g, asked %g: rms %.1e, at most %.1e\n", name, tilt, asked, rms,
                    largest);
        EXPECT_LT(largest, asked);
        if (asked > 2e-2f) {
          EXPECT_GT(rms, 5e-4);
        }
      }
    }
}

// Where the support of one image covers more texels than a block has room for, cells are taken.
TEST(Gloss, SupportsOfManyTexelsTakeNoBlocks) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  LuminaireShape shape = SmallLamp();
  shape.width = 300;
  shape.height = 230;
  const LuminaireOnDevice luminaire(device, StructuredLuminaire("facets", shape, kSeed));
  const TestBrdf brdf = TestBrdf::Phong({0.1, 0.2, 0.3}, {0.6, 0.6, 0.6}, 16);
  const GBuffer gbuffer =
      MakeGlossyGBuffer(device, MirroringReceivers(0.3, 200, 0.4, 0.1, 8), brdf);
  EstimatorOptions options;
  options.max_error = 1e-4f;
  const Lit fine = LightGBuffer(device, *gloss, gbuffer, luminaire, options);
  options.max_error = 3e-2f;
  const Lit lit = LightGBuffer(device, *gloss, gbuffer, luminaire, options);
  for (std::size_t k = 0; k < lit.reflected.size(); ++k)
    EXPECT_NEAR(lit.reflected[k].s[0], fine.reflected[k].s[0], 3e-2 * fine.reflected[k].s[0]) << k;
}

// Lambertian surfaces of a glossy scene, and the irradiance of any, are closed forms; horizons
// through the lamp included.
TEST(Gloss, IrradianceAndLambertianPartsAreExact) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  LuminaireShape shape = SmallLamp();
  shape.channels = 3;
  const auto field = StructuredLuminaire("filament", shape, kSeed);
  const LuminaireOnDevice luminaire(device, field);
  GlossyPoints points = MirroringReceivers(0.3, 60, 0.4, 0.05, 20);
  core::Random random(kSeed, 5);
  for (std::size_t k = 0; k < points.points.size(); k += 3) {
    auto& [p, n] = points.points[k];
    const Vec3 u{0.02 * (random.Uniform() - 0.5), 0.02 * (random.Uniform() - 0.5), 0};
    const Vec3 side = Cross(Normalized(p - u), {random.Normal(), random.Normal(), random.Normal()});
    n = RoundToFloat({p, Normalized(Dot(side, points.eye - p) < 0 ? -1.0 * side : side)}).n;
  }
  int cut = 0, lit_pixels = 0;
  // Lambert; Phong without a lobe, whose diffuse part goes another way through the kernel.
  for (const TestBrdf& brdf :
       {TestBrdf{kLambert, {0.3, 0.6, 0.9}, {}}, TestBrdf::Phong({0.3, 0.6, 0.9}, {0, 0, 0}, 100),
        TestBrdf::Phong({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, 500)}) {
    const bool diffuse = brdf.kind == kLambert || brdf.gloss[0] == 0;
    EstimatorOptions options;
    options.max_error = 1e-2f;
    const Lit lit =
        LightGBuffer(device, *gloss, MakeGlossyGBuffer(device, points, brdf), luminaire, options);
    for (std::size_t k = 0; k < points.points.size(); ++k) {
      const auto [p, n] = points.points[k];
      const auto judge = lightfield::ExactIrradiance(field, p, n);
      const auto j = lightfield::ClosedFormLightVector(field, p);
      cut += lightfield::HorizonCutsSupport(field.geometry, p, n);
      for (int c = 0; c < 3; ++c) {
        const double size = Length(j.j[c]);
        lit_pixels += size > 0;
        EXPECT_NEAR(lit.irradiance[k].s[c], judge[c], 1e-5 * size) << k;
        if (diffuse) {
          EXPECT_NEAR(lit.reflected[k].s[c], brdf.albedo[c] / std::numbers::pi * judge[c],
                      1e-5 * size)
              << k;
        }
      }
    }
  }
  EXPECT_GT(cut, 30);
  EXPECT_GT(lit_pixels, 300);
}

// One channel of a field, as channel 0 of another.
lightfield::LightField ChannelOf(const lightfield::LightField& field, int channel) {
  auto geometry = field.geometry;
  geometry.channels = 1;
  lightfield::LightField out(geometry);
  for (int m = 0; m < geometry.grid.count(); ++m)
    std::copy(field.image(m, channel).begin(), field.image(m, channel).end(),
              out.image(m, 0).begin());
  return out;
}

TEST(Gloss, EveryChannelHasItsOwnCentroid) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  LuminaireShape shape = SmallLamp();
  shape.channels = 3;
  const auto field = StructuredLuminaire("facets", shape, kSeed);
  const auto points = MirroringReceivers(0.3, 12, 0.02);
  const auto brdf = TestBrdf::Phong({0.1, 0.2, 0.3}, {0.4, 0.4, 0.4}, 300);
  const Lit lit = LightGBuffer(device, *gloss, MakeGlossyGBuffer(device, points, brdf),
                               LuminaireOnDevice(device, field));
  for (int c = 0; c < 3; ++c) {
    auto channel = brdf;
    std::rotate(channel.albedo.begin(), channel.albedo.begin() + c, channel.albedo.end());
    const auto judge = Judge(ChannelOf(field, c), points, channel, 1);
    for (std::size_t k = 0; k < judge.size(); ++k)
      EXPECT_NEAR(lit.reflected[k].s[c], judge[k], 1e-2 * judge[k]) << k << " " << c;
  }
}

// Receivers from 1 nm to 1000 km in front of I, on it, between the planes, behind the lamp.
TEST(Gloss, ReceiversAtAnyDistance) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  LuminaireShape shape = SmallLamp();
  shape.delta_m = 0.25;  // a float: receivers lie on I exactly
  const auto field = StructuredLuminaire("noise", shape, kSeed);
  const LuminaireOnDevice luminaire(device, field);
  const auto brdf = TestBrdf::Ggx({0.9, 0.6, 0.3}, 0.3, 0.5);
  for (const double D : {-0.249, -0.2, -0.1, -1e-6, 0.0, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    GlossyPoints points;
    points.eye = {0.5 * (1 + D), -0.5 * (1 + D), 0.25 + 0.4 * (1 + D)};
    core::Random random(kSeed, 6);
    for (int k = 0; k < 8; ++k) {
      const Vec3 p{0.05 * (random.Uniform() - 0.5), 0.04 * (random.Uniform() - 0.5), 0.25 + D};
      points.points.push_back(RoundToFloat(
          {p, Normalized(Normalized(Vec3{0, 0, 0} - p) + Normalized(points.eye - p))}));
    }
    EstimatorOptions options;
    options.max_error = 1e-3f;
    const Lit lit =
        LightGBuffer(device, *gloss, MakeGlossyGBuffer(device, points, brdf), luminaire, options);
    const auto judge = Judge(field, points, brdf, 3);
    const double error = RelativeRms(lit.reflected, judge);
    std::printf("D %g m: error %.1e\n", D, error);
    // 1 mm before F the finest part of a cell is half as wide as it is far: 32 parts do not resolve
    // the lobe, what is left of the promise is a bounded error.
    EXPECT_LT(error, D < -0.24 ? 0.2 : 1e-3) << D;
  }
  GlossyPoints behind;
  for (const double z : {0.0, -1e-6, -1.0})
    behind.points.push_back(RoundToFloat({{0, 0.01, z}, {0, 0, 1}}));
  for (const auto& value :
       LightGBuffer(device, *gloss, MakeGlossyGBuffer(device, behind, brdf), luminaire).reflected)
    EXPECT_EQ(value.s[0], 0);
}

TEST(Gloss, NegativeCoefficientsKeepTheIrradianceExact) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device);
  auto field = StructuredLuminaire("noise", SmallLamp(), kSeed);
  for (std::size_t k = 0; k < field.data.size(); k += 2) field.data[k] = -field.data[k];
  auto absolute = field;
  for (float& c : absolute.data) c = std::abs(c);
  const auto points = MirroringReceivers(0.3, 30, 0.1);
  const Lit lit = LightGBuffer(
      device, *gloss,
      MakeGlossyGBuffer(device, points, TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 64)),
      LuminaireOnDevice(device, field));
  for (std::size_t k = 0; k < points.points.size(); ++k) {
    const auto [p, n] = points.points[k];
    const double size = Length(lightfield::ClosedFormLightVector(absolute, p).j[0]);
    EXPECT_NEAR(lit.irradiance[k].s[0], lightfield::ExactIrradiance(field, p, n)[0], 1e-5 * size);
    EXPECT_TRUE(std::isfinite(lit.reflected[k].s[0]));
  }
}

// Means over seeds against the judge: |t| pooled over pixels, and the mean of t^2.
// Samples that follow the light, the BRDF, and both, at lobes from broad to narrower than the lamp.
TEST(Windowed, IsUnbiasedOnGlossySurfaces) {
  constexpr int kSeeds = 64, kPixels = 60;
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const LitLuminaire lamp(device, StructuredLuminaire("facets", SmallLamp(), kSeed));
  struct Lobe {
    TestBrdf brdf;
    double tilt;  // of the receivers, rad: some lobes miss the lamp, most do not
    int splits;
  };
  for (const auto& [brdf, tilt, splits] :
       {Lobe{TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 10), 0.2, 2},
        Lobe{TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 1000), 0.03, 2},
        Lobe{TestBrdf::Ggx({0.5, 0.5, 0.5}, 0, 0.3), 0.2, 2},
        Lobe{TestBrdf::Ggx({0.9, 0.6, 0.3}, 1, 0.1), 0.02, 3}}) {
    const auto points = MirroringReceivers(0.3, kPixels, tilt);
    const GBuffer gbuffer = MakeGlossyGBuffer(device, points, brdf);
    const auto judge = Judge(lamp.field, points, brdf, splits);
    double of_light_alone = 0;
    const bool narrow = brdf.kind == kGgx && brdf.gloss[1] < 0.2;
    for (const char* share : {"brdf-share=0", "brdf-share=0.5", "brdf-share=1"}) {
      std::vector<double> sum(kPixels), square(kPixels);
      EstimatorOptions options;
      options.samples_per_pixel = 64;
      options.knobs.Set(share);
      for (int seed = 0; seed < kSeeds; ++seed) {
        options.seed = kSeed + seed;
        const Lit lit = LightGBuffer(device, *windowed, gbuffer, lamp.on_device, options);
        for (int k = 0; k < kPixels; ++k) {
          EXPECT_EQ(lit.samples[k], 64u);
          sum[k] += lit.reflected[k].s[0];
          square[k] += std::pow(lit.reflected[k].s[0], 2);
        }
      }
      double error = 0, variance = 0, t_square = 0;
      for (int k = 0; k < kPixels; ++k) {
        const double mean = sum[k] / kSeeds;
        const double of_mean = (square[k] / kSeeds - mean * mean) / (kSeeds - 1);
        error += mean - judge[k];
        variance += of_mean;
        t_square += std::pow(mean - judge[k], 2) / of_mean / kPixels;
      }
      if (of_light_alone == 0) of_light_alone = variance;
      // Broad lobes get few BRDF samples or none; lobes within the lamp gain by them.
      if (share == std::string("brdf-share=0.5")) {
        EXPECT_LT(variance, (narrow ? 0.5 : 1.3) * of_light_alone);
      }
      const double expected = (kSeeds - 1.0) / (kSeeds - 3.0);
      std::printf(
          "kind %d, gloss %g %g, %s: pooled error %.2f standard errors, mean t^2 %.3f, variance "
          "%.3f of that of light samples\n",
          brdf.kind, brdf.gloss[1], brdf.gloss[3], share, error / std::sqrt(variance), t_square,
          variance / of_light_alone);
      EXPECT_LT(std::abs(error), 3.5 * std::sqrt(variance));
      // Six standard deviations of the mean of t^2, whose variance is about 2.5 (skewed samples).
      if (share != std::string("brdf-share=1")) {
        EXPECT_LT(t_square, expected + 6 * std::sqrt(2.5 / kPixels));
      }
    }
  }
}

// A screen before a part of the lamp: the share of `gloss` tends to what `windowed` sees.
TEST(Gloss, ShadowsTendToThoseOfWindowed) {
  const Device device = Device::Open();
  const auto gloss = MakeEstimator("gloss", device), windowed = MakeEstimator("windowed", device);
  const LitLuminaire lamp(device, StructuredLuminaire("rings", SmallLamp(), kSeed));
  scene::Geometry geometry;
  geometry.materials = {{"screen"}};
  scene::AppendQuad({0.003, -1, 0.2}, {1, 0, 0}, {0, 2, 0}, 0, geometry);
  const auto rays = MakeRayScene(device, geometry);
  const auto points = MirroringReceivers(0.3, 40, 0.1);
  const GBuffer gbuffer =
      MakeGlossyGBuffer(device, points, TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 50));
  EstimatorOptions options;
  options.samples_per_pixel = 20000;
  const Lit truth = LightGBuffer(device, *windowed, gbuffer, lamp.on_device, options, rays.get());
  options.samples_per_pixel = 5000;
  options.seed = 2;
  const Lit lit = LightGBuffer(device, *gloss, gbuffer, lamp.on_device, options, rays.get());
  int half = 0;
  for (std::size_t k = 0; k < points.points.size(); ++k) {
    const double t = truth.reflected[k].s[0], error = lit.reflected[k].s[0] - t;
    // A ratio's bias is of the order of its variance: far below its standard error here.
    EXPECT_NEAR(error, 0, 6 * std::sqrt(truth.variance[k] + lit.variance[k]) + 3e-3 * t) << k;
    EXPECT_EQ(lit.samples[k], 5000u);
    half += lit.variance[k] > 0;
  }
  EXPECT_GT(half, 10);
}

// Traced shadows of estimators without noise are drawn by `cells`, whose tables they need.
TEST(Gloss, ShadowsNeedTheTablesOfCells) {
  const Device device = Device::Open();
  const LitLuminaire lamp(device, StructuredLuminaire("rings", SmallLamp(), kSeed));
  const LuminaireOnDevice of_images(device, lamp.field, {.sat = &lamp.tables}),
      of_cells(device, lamp.field, {.cells = &lamp.cells});
  const auto rays = Blocker(device, 0, 10, 1e-4f);
  const GBuffer gbuffer = MakeGBuffer(device, MirroringReceivers(0.3, 4, 0.1).points);
  for (const char* name : {"exact", "gloss"}) {
    const auto estimator = MakeEstimator(name, device);
    EXPECT_FALSE(estimator->traits().needs_for_shadows.sat) << name;
    EXPECT_THROW(LightGBuffer(device, *estimator, gbuffer, of_images, {}, rays.get()), InputError);
    EXPECT_NO_THROW(LightGBuffer(device, *estimator, gbuffer, of_cells, {}, rays.get())) << name;
    EXPECT_NO_THROW(LightGBuffer(device, *estimator, gbuffer, of_images)) << name;
  }
}

TEST(Gloss, WrongInputIsNamed) {
  const Device device = Device::Open();
  const LitLuminaire lamp(device, StructuredLuminaire("rings", SmallLamp(), kSeed));
  const auto points = MirroringReceivers(0.3, 4, 0.1);
  const GBuffer gbuffer =
      MakeGlossyGBuffer(device, points, TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 50));
  for (const float error : {0.0f, -1.0f, 2.0f, std::nanf("")}) {
    EstimatorOptions options;
    options.max_error = error;
    const auto gloss = MakeEstimator("gloss", device);
    EXPECT_THROW(LightGBuffer(device, *gloss, gbuffer, lamp.on_device, options), InputError);
  }
  const auto exact = MakeEstimator("exact", device);
  EXPECT_THROW(LightGBuffer(device, *exact, gbuffer, lamp.on_device), InputError);
}

}  // namespace
}  // namespace luxfield::render
