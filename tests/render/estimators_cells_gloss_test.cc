// `cells` on glossy surfaces: unbiased against quadrature, and what the BRDF's samples are worth.
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/render/estimators/sampling_estimators.h"
#include "tests/render/brdf_by_formula.h"
#include "tests/render/brute_force.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;

constexpr std::uint64_t kSeed = kSamplingSeed;
const Vec3 kEye{0.7, -1.5, 0.9};

// Receivers whose normals halve the angle between the eye and a point of the lamp, more or less.
std::vector<SurfacePoint> MirroringReceivers(int count, double near = 0.3, double far = 3) {
  core::Random random(kSeed, 6);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < count; ++k) {
    const double D = near * std::pow(far / near, random.Uniform());
    const Vec3 p{0.25 * (0.3 + D) * (random.Uniform() - 0.5),
                 0.25 * (0.3 + D) * (random.Uniform() - 0.5), 0.3 + D};
    const Vec3 u{0.05 * (random.Uniform() - 0.5), 0.03 * (random.Uniform() - 0.5), 0};
    const Vec3 half = Normalized(Normalized(u - p) + Normalized(kEye - p));
    const Vec3 turn{random.Normal(), random.Normal(), random.Normal()};
    points.push_back(RoundToFloat({p, Normalized(half + 0.03 * Normalized(turn))}));
  }
  return points;
}

GBuffer GlossyGBuffer(const Device& device, const std::vector<SurfacePoint>& points,
                      const TestBrdf& brdf) {
  GBuffer gbuffer = MakeGBuffer(device, points, true);
  gbuffer.albedo.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.size(), brdf.AlbedoTexel())));
  gbuffer.gloss.Upload(
      std::span<const cl_float4>(std::vector<cl_float4>(points.size(), brdf.GlossTexel())));
  gbuffer.eye = {
      {static_cast<float>(kEye.x), static_cast<float>(kEye.y), static_cast<float>(kEye.z), 1}};
  return gbuffer;
}

std::vector<double> Judge(const lightfield::LightField& field,
                          const std::vector<SurfacePoint>& points, const TestBrdf& brdf,
                          int splits) {
  const Vec3 eye = RoundToFloat({kEye, {0, 0, 1}}).p;
  std::vector<double> radiance;
  for (const auto& [p, n] : points) {
    const Vec3 to_eye = Normalized(eye - p);
    radiance.push_back(BruteForceRadiance(
        field, p, n, splits, [&](Vec3 w) { return BrdfByFormula(brdf, n, to_eye, w)[0]; }));
  }
  return radiance;
}

struct Lobe {
  const char* name;
  TestBrdf brdf;
  int splits;  // of the quadrature: 1.5e-5 or less of it changes from splits - 1 to splits
};

std::vector<Lobe> Lobes() {
  const std::array<double, 3> grey{0.5, 0.5, 0.5}, diffuse{0.2, 0.2, 0.2}, lobe{0.6, 0.6, 0.6};
  return {{"phong 20", TestBrdf::Phong(diffuse, lobe, 20), 1},
          {"phong 1000", TestBrdf::Phong(diffuse, lobe, 1000), 2},
          {"ggx dielectric 0.3", TestBrdf::Ggx(grey, 0, 0.3), 2},
          {"ggx metal 0.1", TestBrdf::Ggx(grey, 1, 0.1), 3}};
}

// Statistics over seeds of the radiance and of the irradiance, which the same samples estimate.
struct Shown {
  SeedStatistics radiance, irradiance;
};

Shown ShownOverSeeds(const Device& device, Estimator& estimator, const GBuffer& gbuffer,
                     const LuminaireOnDevice& luminaire, int samples, int seeds,
                     float brdf_share = 0.5f) {
  Shown shown;
  SeedSums radiance(gbuffer.pixel_count()), irradiance(gbuffer.pixel_count());
  for (int seed = 0; seed < seeds; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = samples;
    options.seed = kSeed + seed;
    options.knobs.brdf_share = brdf_share;
    const Lit lit = LightGBuffer(device, estimator, gbuffer, luminaire, options);
    radiance.Add(lit.reflected, lit.variance);
    irradiance.Add(lit.irradiance, lit.variance);
  }
  return {radiance.Statistics(), irradiance.Statistics()};
}

TEST(CellsGloss, IsUnbiasedWithHalfTheSamplesFromTheBrdf) {
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const auto points = MirroringReceivers(24);
  LuminaireShape shape;
  shape.width = 37;
  shape.height = 29;
  const auto field = StructuredLuminaire("facets", shape, kSeed);
  const LitLuminaire luminaire(device, field);
  std::vector<double> irradiance;
  for (const auto& [p, n] : points)
    irradiance.push_back(lightfield::ExactIrradiance(field, p, n)[0]);
  for (const auto& [name, brdf, splits] : Lobes()) {
    const GBuffer gbuffer = GlossyGBuffer(device, points, brdf);
    const auto judge = Judge(field, points, brdf, splits);
    for (const int samples : {1, 2, 64}) {
      const Shown shown = ShownOverSeeds(device, *cells, gbuffer, luminaire.on_device, samples, 64);
      const std::string what = std::string(name) + ", K " + std::to_string(samples);
      ExpectUnbiased(shown.radiance, judge, 64, what.c_str());
      ExpectUnbiased(shown.irradiance, irradiance, 64, (what + ", irradiance").c_str());
    }
  }
}

// Few light samples fall into a narrow lobe, most of the BRDF's do.
TEST(CellsGloss, BrdfSamplesTameNarrowLobes) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const auto points = MirroringReceivers(40, 0.1, 0.5);
  const auto field = StructuredLuminaire("facets", {}, kSeed);
  const LitLuminaire luminaire(device, field);
  const TestBrdf brdf = TestBrdf::Ggx({0.5, 0.5, 0.5}, 1, 0.1);
  const GBuffer gbuffer = GlossyGBuffer(device, points, brdf);
  double error[2] = {};
  for (const int which : {0, 1}) {
    const Shown shown =
        ShownOverSeeds(device, *cells, gbuffer, luminaire.on_device, 64, 64, which ? 0.5f : 0.0f);
    for (std::size_t k = 0; k < points.size(); ++k)
      error[which] += 64 * std::pow(shown.radiance.standard_error[k], 2);
    error[which] = std::sqrt(error[which] / static_cast<double>(points.size()));
  }
  std::printf(
      "GGX metal of roughness 0.1, 64 samples: RMSE by light alone %.3g, with half of them from "
      "the "
      "BRDF %.3g\n",
      error[0], error[1]);
  EXPECT_LT(error[1], 0.6 * error[0]);
}

}  // namespace
}  // namespace luxfield::render
