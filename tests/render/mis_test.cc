// Two strategies combined: the share that a pilot chooses, unbiasedness of every combination for
// environments, luminaires and glossy surfaces, extremes of densities.
#include "luxfield/render/estimators/mis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "luxfield/core/error.h"
#include "luxfield/environment/environment_map.h"
#include "tests/render/area_light_fixture.h"
#include "tests/render/brdf_by_formula.h"
#include "tests/render/environment_fixture.h"

namespace luxfield::render {
namespace {

using environment::CubeMap;
using lightfield::Vec3;

const char* const kShareKernel = R"(
#include "luxfield/render/kernels/mis/light_share.clh"

__kernel void Share(__global const float2* samples, int count, int steps, float guard,
                    __global float* share) {
  Pilot pilot;
  pilot.count = count;
  for (int k = 0; k < count; ++k) pilot.samples[k] = samples[get_global_id(0) * count + k];
  share[get_global_id(0)] = BestLightShare(&pilot, steps, guard);
}
)";

using PilotSamples = std::vector<std::pair<double, double>>;  // g^2, x

double SecondMoment(const PilotSamples& pilot, double share) {
  double sum = 0;
  for (const auto& [square, x] : pilot) sum += square / (1 + (2 * share - 1) * x);
  return sum;
}

// The convex function's least value over the shares allowed, by golden sections.
double BestShare(const PilotSamples& pilot) {
  double low = 0.025, high = 0.975;
  const double golden = (std::sqrt(5.0) - 1) / 2;
  while (high - low > 1e-9) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    if (SecondMoment(pilot, a) < SecondMoment(pilot, b))
      high = b;
    else
      low = a;
  }
  return (low + high) / 2;
}

class ShareTest : public testing::Test {
 protected:
  std::vector<float> Shares(const std::vector<PilotSamples>& pilots, int steps,
                            float guard = 0) const {
    std::vector<cl_float2> samples;
    for (const auto& pilot : pilots)
      for (const auto& [square, x] : pilot)
        samples.push_back({{static_cast<float>(square), static_cast<float>(x)}});
    const Buffer from = Buffer::From(device_, samples);
    Buffer shares(device_, pilots.size() * sizeof(float));
    Kernel(program_, "Share")
        .Set(from, static_cast<cl_int>(pilots[0].size()), static_cast<cl_int>(steps), guard, shares)
        .Enqueue({pilots.size()}, {1});
    return shares.Download<float>();
  }

  Device device_ = Device::Open();
  Program program_ = Program::BuildText(device_, kShareKernel, "mis_test.cl");
};

// One step is the thesis' formula; the steps end at the least second moment; the former is off
// where only one strategy has density (3/4) and overshoots, the latter is not.
TEST_F(ShareTest, NewtonStepsEndAtTheLeastSecondMoment) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSamplingSeed));
  core::Random random(kSamplingSeed, 5);
  std::vector<PilotSamples> pilots;
  for (int k = 0; k < 400; ++k) {
    PilotSamples pilot;
    const double lean = 2 * random.Uniform() - 1, spread = random.Uniform();
    for (int i = 0; i < 32; ++i)
      pilot.push_back(
          {std::exp(3 * random.Normal()), std::clamp(lean + spread * random.Normal(), -1.0, 1.0)});
    pilots.push_back(pilot);
  }
  const auto one = Shares(pilots, 1), ten = Shares(pilots, 10);
  double worst_one = 0, worst_ten = 0, off_ten = 0;
  for (std::size_t k = 0; k < pilots.size(); ++k) {
    double first = 0, second = 0;
    for (const auto& [square, x] : pilots[k]) {
      first += square * x;
      second += square * x * x;
    }
    EXPECT_NEAR(one[k], std::clamp(0.5 + 0.25 * first / second, 0.025, 0.975), 1e-5);
    const double best = BestShare(pilots[k]), least = SecondMoment(pilots[k], best);
    worst_one = std::max(worst_one, SecondMoment(pilots[k], one[k]) / least - 1);
    worst_ten = std::max(worst_ten, SecondMoment(pilots[k], ten[k]) / least - 1);
    off_ten = std::max(off_ten, std::abs(ten[k] - best));
  }
  std::printf("second moment above the least: one step %.3f, ten %.2e; share off by %.2e\n",
              worst_one, worst_ten, off_ten);
  EXPECT_GT(worst_one, 0.1);
  EXPECT_LT(worst_ten, 1e-3);

  // Only the light has density, only the BRDF has.
  const PilotSamples light(32, {2.0, 1.0}), brdf(32, {2.0, -1.0});
  EXPECT_NEAR(Shares({light}, 1)[0], 0.75, 1e-6);
  EXPECT_NEAR(Shares({light}, 10)[0], 0.975, 1e-6);
  EXPECT_NEAR(Shares({brdf}, 1)[0], 0.25, 1e-6);
  EXPECT_NEAR(Shares({brdf}, 10)[0], 0.025, 1e-6);
  // Densities that differ little, but for one sample: one step goes to the end of the interval.
  PilotSamples over(32, {1.0, 0.3});
  over[0] = {3.0, -0.6};
  std::printf("overshoot: one step %.3f, ten %.3f, best %.3f\n", Shares({over}, 1)[0],
              Shares({over}, 10)[0], BestShare(over));
  EXPECT_GT(Shares({over}, 1)[0], BestShare(over) + 0.05);
  EXPECT_NEAR(Shares({over}, 10)[0], BestShare(over), 1e-3);
  // Nothing seen, and strategies that are the same.
  for (const int steps : {1, 10}) {
    EXPECT_EQ(Shares({PilotSamples(32, {0.0, 0.5})}, steps)[0], 0.5f);
    EXPECT_EQ(Shares({PilotSamples(32, {1.0, 0.0})}, steps)[0], 0.5f);
  }
}

// A guarded share is the least of the sum that has two samples more.
TEST_F(ShareTest, GuardedSharesKeepToWhatTheirPilotMayHaveMissed) {
  constexpr int kSamples = 32;
  constexpr float kGuard = 1.0f / kSamples;
  // Only one strategy has density: (1 + t) / (1 - t) = sqrt(M + 1).
  const double ratio = std::sqrt(kSamples + 1.0), share = ratio / (1 + ratio);
  EXPECT_NEAR(Shares({PilotSamples(kSamples, {2.0, 1.0})}, 10, kGuard)[0], share, 1e-3);
  EXPECT_NEAR(Shares({PilotSamples(kSamples, {2.0, -1.0})}, 10, kGuard)[0], 1 - share, 1e-3);
  EXPECT_EQ(Shares({PilotSamples(kSamples, {0.0, 0.5})}, 10, kGuard)[0], 0.5f);
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSamplingSeed));
  core::Random random(kSamplingSeed, 6);
  for (int k = 0; k < 50; ++k) {
    PilotSamples pilot;
    double sum = 0;
    for (int i = 0; i < kSamples; ++i) {
      pilot.push_back({std::exp(3 * random.Normal()), 2 * random.Uniform() - 1});
      sum += pilot.back().first;
    }
    const float guarded = Shares({pilot}, 10, kGuard)[0];
    pilot.push_back({sum / kSamples, 1.0});
    pilot.push_back({sum / kSamples, -1.0});
    EXPECT_NEAR(guarded, BestShare(pilot), 2e-3);
  }
}

EnvironmentLight MakeLight(const Device& device, const CubeMap& map,
                           const EnvironmentKnobs& knobs = {}) {
  EnvironmentLight light(device, map.face_size, {knobs.tiles, knobs.compensation});
  light.Show(map);
  return light;
}

Lit LightBy(const Device& device, MisEstimator& estimator, const GBuffer& gbuffer,
            const EnvironmentLight& light, const EstimatorOptions& options,
            const Buffer* light_share = nullptr) {
  Lighting lighting(device, gbuffer);
  lighting.light_share = light_share;
  estimator.Light({gbuffer}, light, options, lighting);
  return {lighting.irradiance.Download<cl_float4>(),
          {},
          lighting.variance.Download<float>(),
          lighting.samples.Download<cl_uint>()};
}

TEST(MisEstimator, EnvironmentOf24Orientations) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kCopies = 512;
  std::vector<SurfacePoint> points;
  for (const Vec3& n : Orientations(24)) points.push_back(RoundToFloat({{}, n}));
  const GBuffer gbuffer = MakeGBuffer(device, Repeated(points, kCopies));
  struct Setting {
    std::string name;
    CubeMap map;
    EnvironmentKnobs knobs;
  };
  const Setting settings[] = {{"noise", NoiseMap(12), {}},
                              {"sky", SunAndSky(32, 100), {}},
                              {"sky, 4 x 4 tiles", SunAndSky(32, 100), {TileBalance::kCosine, 4}},
                              {"noise, whole map", NoiseMap(12), {TileBalance::kNone}},
                              {"noise, compensated",
                               NoiseMap(12),
                               {TileBalance::kUniform, 1, SampleSets::kScrambled, 0.5f, 1}}};
  for (const Setting& setting : settings) {
    const EnvironmentLight light = MakeLight(device, setting.map, setting.knobs);
    std::vector<double> exact;
    for (const auto& point : points)
      exact.push_back(core::Luminance(Irradiance(setting.map, point.n)));
    for (const Strategies strategies : AllStrategies()) {
      // Samples of the BRDF alone find the sun a few times in all.
      if (strategies == Strategies::kBrdf && setting.map.face_size == 32) continue;
      if (strategies == Strategies::kLight && setting.knobs.compensation > 0) continue;
      EstimatorOptions options = WithStrategies(strategies, 17);
      options.knobs.environment = setting.knobs;
      const Lit lit = LightBy(device, estimator, gbuffer, light, options);
      ExpectUnbiased(OverCopies(lit.irradiance, lit.variance, kCopies), exact, kCopies,
                     (setting.name + ", " + options.knobs.strategies.Text()).c_str(),
                     4.0 / (kCopies * 17));
    }
  }
}

TEST(MisEstimator, LuminairesOnLambertianSurfaces) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kCopies = 128;
  const auto points = FacingReceivers(0.3, 40);
  const GBuffer gbuffer = MakeGBuffer(device, Repeated(points, kCopies));
  for (const char* kind : {"facets", "filament"}) {
    LuminaireShape shape;
    shape.channels = 3;
    const LitLuminaire luminaire(device, StructuredLuminaire(kind, shape, kSamplingSeed));
    for (const Strategies strategies : AllStrategies()) {
      // Samples of the BRDF alone hardly ever meet the lamp.
      if (strategies == Strategies::kBrdf) continue;
      const EstimatorOptions options = WithStrategies(strategies, 24);
      Lighting lighting(device, gbuffer);
      estimator.Light({gbuffer}, PosedLuminaire{luminaire.on_device}, options, lighting);
      ExpectUnbiased(OverCopies(lighting.irradiance.Download<cl_float4>(),
                                lighting.variance.Download<float>(), kCopies),
                     ExactLuminance(luminaire.field, points), kCopies,
                     (kind + (", " + options.knobs.strategies.Text())).c_str(),
                     4.0 / (kCopies * 24));
    }
  }
}

// Reflected radiance of a rectangle, parts^2 midpoints, in double.
double ReflectedLuminance(const scene::AreaLight& light, const SurfacePoint& point,
                          const TestBrdf& brdf, Vec3 eye, int parts) {
  double sum = 0;
  const Vec3 axis = light.world_from_light.Vector({0, 0, 1});
  for (int j = 0; j < parts; ++j)
    for (int i = 0; i < parts; ++i) {
      const Vec3 to_light =
          light.world_from_light.Point({((i + 0.5) / parts - 0.5) * light.width_m,
                                        ((j + 0.5) / parts - 0.5) * light.height_m, 0}) -
          point.p;
      const double r = Length(to_light);
      const Vec3 w = (1 / r) * to_light;
      const double cosine = Dot(point.n, w), light_cosine = -Dot(axis, w);
      if (cosine <= 0 || light_cosine <= 0) continue;
      const auto f = BrdfByFormula(brdf, point.n, Normalized(eye - point.p), w);
      sum += Luminance(std::array<double, 3>{f[0] * light.radiance[0], f[1] * light.radiance[1],
                                             f[2] * light.radiance[2]}) *
             cosine * light_cosine / (r * r);
    }
  return sum * light.width_m * light.height_m / (double(parts) * parts);
}

TEST(MisEstimator, GlossySurfacesUnderARectangle) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kCopies = 512, kSamples = 24;
  const scene::AreaLight light =
      Rectangle(0.6, 0.4, scene::LookAt({0.2, 0.3, 1}, {0, 0, 0}, {0, 1, 0}));
  const std::vector<TestBrdf> brdfs{
      TestBrdf{}, TestBrdf::Phong({0.3, 0.2, 0.1}, {0.5, 0.6, 0.4}, 20),
      TestBrdf::Phong({0.1, 0.1, 0.1}, {0.5, 0.6, 0.4}, 300),
      TestBrdf::Ggx({0.8, 0.6, 0.3}, 1, 0.4), TestBrdf::Ggx({0.3, 0.5, 0.7}, 0, 0.6)};
  const Vec3 eye{-0.4, -0.5, 1.2};
  std::vector<SurfacePoint> points;
  std::vector<cl_float4> albedo, gloss;
  std::vector<double> exact;
  for (const TestBrdf& brdf : brdfs)
    for (const double x : {-0.4, -0.1, 0.2}) {
      const SurfacePoint point = RoundToFloat({{x, 0.3 * x, 0}, Normalized(Vec3{0.1, 0.1, 1})});
      points.push_back(point);
      exact.push_back(ReflectedLuminance(light, point, brdf, eye, 400));
      albedo.insert(albedo.end(), kCopies, brdf.AlbedoTexel());
      gloss.insert(gloss.end(), kCopies, brdf.GlossTexel());
    }
  GBuffer gbuffer = MakeGBuffer(device, Repeated(points, kCopies), true);
  gbuffer.albedo.Upload(std::span<const cl_float4>(albedo));
  gbuffer.gloss.Upload(std::span<const cl_float4>(gloss));
  gbuffer.eye = {
      {static_cast<float>(eye.x), static_cast<float>(eye.y), static_cast<float>(eye.z), 1}};
  Buffer shares(device, gbuffer.pixel_count() * sizeof(float));
  for (const Strategies strategies : AllStrategies()) {
    const EstimatorOptions options = WithStrategies(strategies, kSamples);
    const Lit lit = LightByArea(device, estimator, gbuffer, light, options, nullptr, &shares);
    auto statistics = OverCopies(lit.reflected, lit.variance, kCopies);
    for (std::size_t k = 0; k < exact.size(); ++k)  // of the quadrature
      statistics.standard_error[k] = std::hypot(statistics.standard_error[k], 1e-4 * exact[k]);
    ExpectUnbiased(statistics, exact, kCopies, options.knobs.strategies.Text().c_str(),
                   4.0 / (kCopies * kSamples));
    for (const float share : shares.Download<float>()) {
      if (strategies == Strategies::kLight) {
        EXPECT_EQ(share, 1);
      } else if (strategies == Strategies::kBrdf) {
        EXPECT_EQ(share, 0);
      } else if (IsAdaptive(strategies)) {
        EXPECT_TRUE(share >= 0.0249f && share <= 0.9751f) << share;
      }
    }
  }
}

// 1 - (1 - p_l / P) / 2 where the light's density p_l is below the largest of the BRDF's samples,
// else 1.
TEST(MisEstimator, SharesByTheLobe) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kSamples = 1000;
  const double pi = std::numbers::pi;
  const auto share = [&](const TestBrdf& brdf, const scene::AreaLight& light) {
    const std::vector<SurfacePoint> points{{{0, 0, 0}, {0, 0, 1}}};
    GBuffer gbuffer = MakeGBuffer(device, points, true);
    const cl_float4 albedo = brdf.AlbedoTexel(), gloss = brdf.GlossTexel();
    gbuffer.albedo.Upload(std::span<const cl_float4>(&albedo, 1));
    gbuffer.gloss.Upload(std::span<const cl_float4>(&gloss, 1));
    gbuffer.eye = {{0, 0, 1, 1}};
    const Buffer shares(device, sizeof(float));
    LightByArea(device, estimator, gbuffer, light, WithStrategies(Strategies::kLobe, kSamples),
                nullptr, &shares);
    return double{shares.Download<float>()[0]};
  };
  const scene::Pose down = scene::Translation({0, 0, 1}) * scene::RotationXyz({180, 0, 0});
  EXPECT_EQ(share(TestBrdf{}, Rectangle(0.6, 0.4, down)), 1);
  // Almost all of the hemisphere: p_l = 1 / (2 pi), P = 1 / pi.
  EXPECT_NEAR(share(TestBrdf{}, Rectangle(1e4, 1e4, down)), 0.75, 1.0 / kSamples);
  // A sphere of angle asin(0.2); a Phong lobe's densest sample, the diffuse part's share included.
  const TestBrdf phong = TestBrdf::Phong({0.2, 0.2, 0.2}, {0.6, 0.6, 0.6}, 300);
  const double density = 1 / (2 * pi * (1 - std::sqrt(1 - 0.2 * 0.2))),
               peak = 0.25 / pi + 0.75 * 301 / (2 * pi);
  EXPECT_NEAR(share(phong, Sphere(0.2, {0, 0, 1})), 1 - (1 - density / peak) / 2, 1.0 / kSamples);
  EXPECT_NEAR(share(TestBrdf::Phong({0, 0, 0}, {1, 1, 1}, 2e4), Rectangle(1, 1, down)), 0.5,
              1.0 / kSamples);
}

TEST(MisEstimator, GivenSharesAreUnbiased) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kCopies = 1024;
  const SurfacePoint point = RoundToFloat({{0.1, 0.2, 0}, {0, 0, 1}});
  const GBuffer gbuffer = MakeGBuffer(device, Repeated({point}, kCopies));
  const EnvironmentLight light = MakeLight(device, NoiseMap(12));
  const double exact = core::Luminance(Irradiance(NoiseMap(12), point.n));
  for (const float share : {0.0f, 0.1f, 0.6f, 1.0f})
    for (const int samples : {1, 7, 32}) {
      const Buffer shares = Buffer::From(device, std::vector<float>(kCopies, share));
      const Lit lit = LightBy(device, estimator, gbuffer, light,
                              WithStrategies(Strategies::kGiven, samples), &shares);
      ExpectUnbiased(OverCopies(lit.irradiance, lit.variance, kCopies), {exact}, kCopies, "given",
                     4.0 / (kCopies * samples));
      for (const float value : shares.Download<float>()) ASSERT_EQ(value, share);
    }
}

// docs/theory.md 12: one texel is the sun, faces are black, the two densities agree, few samples.
TEST(MisEstimator, ExtremesHaveTheirAnswers) {
  const Device device = Device::Open();
  MisEstimator estimator(device);
  constexpr int kCopies = 1024;
  const SurfacePoint up{{}, {0, 0, 1}};
  const GBuffer gbuffer = MakeGBuffer(device, Repeated({up}, kCopies));
  CubeMap sun = MakeMap(8, [](Vec3) -> core::Rgb { return {1, 1, 1}; });
  for (int channel = 0; channel < 3; ++channel) sun.at(4, 3, 5, channel) = 1e5f;
  CubeMap below(8), above(8);
  std::fill(below.data.end() - 3 * 8 * 8, below.data.end(), 1.0f);
  std::fill_n(above.data.begin() + 3 * 4 * 8 * 8, 3 * 8 * 8, 2.0f);
  // Radiance in proportion to the receiver's cosine: light and BRDF have all but one density.
  const CubeMap same = MakeMap(64, [](Vec3 w) -> core::Rgb {
    const double y = std::max(0.0, w.z);
    return {y, y, y};
  });
  for (const Strategies strategies : AllStrategies())
    for (const int samples : {1, 2, 3, 4, 32}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(strategies) << ", " << samples);
      const EstimatorOptions options = WithStrategies(strategies, samples);
      for (const auto& e :
           LightBy(device, estimator, gbuffer, MakeLight(device, CubeMap(8)), options).irradiance)
        ASSERT_EQ(e.s[1], 0);
      for (const auto& e :
           LightBy(device, estimator, gbuffer, MakeLight(device, below), options).irradiance)
        ASSERT_EQ(e.s[1], 0);
      for (const CubeMap* map : std::initializer_list<const CubeMap*>{&above, &same, &sun}) {
        if (map == &sun && (strategies == Strategies::kBrdf || samples < 32)) continue;
        const Lit lit = LightBy(device, estimator, gbuffer, MakeLight(device, *map), options);
        const auto statistics = OverCopies(lit.irradiance, lit.variance, kCopies);
        const double exact = core::Luminance(Irradiance(*map, up.n));
        EXPECT_NEAR(statistics.mean[0], exact, 5 * statistics.standard_error[0] + 1e-3 * exact);
        if (map == &same) {
          EXPECT_LT(statistics.standard_error[0] * std::sqrt(kCopies * double(samples)),
                    (strategies == Strategies::kMaximum ? 2 : 0.7) * exact);
        }
      }
    }
}

TEST(MisEstimator, WrongOptionsAreNamed) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const Device device = Device::Open();
  MisEstimator estimator(device);
  const GBuffer gbuffer = FacingGBuffer(device, {{0, 0, 1}});
  const auto light = [&](const EstimatorOptions& options) {
    LightBy(device, estimator, gbuffer, MakeLight(device, NoiseMap(4), options.knobs.environment),
            options);
  };
  EXPECT_THAT([&] { light(WithStrategies(Strategies::kGiven, 8)); },
              ThrowsMessage<InputError>(HasSubstr("strategies=given takes the share")));
  EXPECT_THAT([&] { light(WithStrategies(Strategies::kNewton, 0)); },
              ThrowsMessage<InputError>(HasSubstr("samples per pixel")));
  EstimatorOptions options = WithStrategies(Strategies::kLight, 8);
  options.knobs.environment.compensation = 1;
  EXPECT_THAT([&] { light(options); }, ThrowsMessage<InputError>(HasSubstr("compensation")));
  options = WithStrategies(Strategies::kLight, 8);
  options.knobs.environment.sets = SampleSets::kShared;
  EXPECT_THAT([&] { light(options); }, ThrowsMessage<InputError>(HasSubstr("scrambled")));
  Knobs knobs;
  knobs.Set("strategies=second-order");
  knobs.Set("strategies-for=all");
  knobs.Set("pilot=32");
  knobs.Set("light-share=0.75");
  EXPECT_EQ(knobs.strategies.Text(),
            "strategies=second-order strategies-for=all light-share=0.75 pilot=32");
  EXPECT_THAT([&] { knobs.Set("pilot=33"); }, ThrowsMessage<InputError>(HasSubstr("even")));
  EXPECT_THAT([&] { knobs.Set("strategies=veach"); },
              ThrowsMessage<InputError>(HasSubstr("newton")));
}

}  // namespace
}  // namespace luxfield::render
