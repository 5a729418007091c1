// Every sampling estimator that claims to be unbiased is; the knobs of `thesis` do what they say;
// passes of different seeds are independent; extremes of tables and random numbers.
#include <gtest/gtest.h>

#include <random>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/sequences.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

using lightfield::Vec3;

EstimatorOptions WithSamples(int samples) {
  EstimatorOptions options;
  options.samples_per_pixel = samples;
  return options;
}

TEST(SamplingEstimators, ThoseThatClaimItAreUnbiased) {
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSamplingSeed));
  const Device device = Device::Open();
  const auto points = FacingReceivers(0.3, 64);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const auto& traits : EstimatorList()) {
    if (!traits.unbiased || traits.noise_free || !traits.needs.sat) continue;
    const auto estimator = MakeEstimator(traits.name, device);
    for (const char* kind : {"facets", "filament"}) {
      LuminaireShape shape;
      shape.channels = kind[1] == 'a' ? 3 : 1;
      const LitLuminaire luminaire(device, StructuredLuminaire(kind, shape, kSamplingSeed));
      const auto options = WithSamples(traits.name == "precomputed" ? 2000 : 64);
      ExpectUnbiased(OverSeeds(device, *estimator, gbuffer, luminaire.on_device, options, 64),
                     ExactLuminance(luminaire.field, points), 64,
                     (traits.name + " " + kind).c_str());
    }
  }
}

TEST(SamplingEstimators, NoProposalOfWindowedBiases) {
  const Device device = Device::Open();
  const auto windowed = MakeEstimator("windowed", device);
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 64);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const char* share : {"basis-share=0", "basis-share=0.25", "basis-share=1"}) {
    EstimatorOptions options = WithSamples(32);
    options.knobs.Set(share);
    ExpectUnbiased(OverSeeds(device, *windowed, gbuffer, luminaire.on_device, options, 64),
                   ExactLuminance(luminaire.field, points), 64, share);
  }
}

// Near I, on it and between the planes, for windows down to a point: `basis` and `uniform`.
TEST(SamplingEstimators, BasisAndUniformAreRegularAtAnyDistance) {
  const Device device = Device::Open();
  for (const char* name : {"basis", "uniform"}) {
    const auto estimator = MakeEstimator(name, device);
    for (const double delta : {0.001, 0.25, 10.0}) {
      LuminaireShape shape;
      shape.delta_m = delta;
      const LitLuminaire luminaire(device, StructuredLuminaire("grain", shape, kSamplingSeed));
      std::vector<SurfacePoint> points;
      for (const double D :
           {0.0, 1e-9, 1e-6, 1e-3, 0.1, 100.0, 1e6, -0.01 * delta, -0.5 * delta, -0.9 * delta})
        for (const double x : {0.0, 0.013, -0.037, 3.0})
          points.push_back(
              RoundToFloat({{x, 0.5 * x + 0.001, delta + D}, Normalized(Vec3{0.1, 0.2, -1})}));
      const auto exact = ExactLuminance(luminaire.field, points);
      for (const int samples : {1, 32})
        ExpectUnbiased(OverSeeds(device, *estimator, MakeGBuffer(device, points),
                                 luminaire.on_device, WithSamples(samples), 64),
                       exact, 64, (name + (" delta " + std::to_string(delta))).c_str());
    }
  }
}

// A window inside one texel: C is constant in it, and what follows Phi has the noise of the
// receiver's cosine alone; `windowed` comes close to it.
TEST(SamplingEstimators, SmallWindowsAreNearlyNoiseFree) {
  const Device device = Device::Open();
  const LuminaireShape shape{.grid_width = 1, .grid_height = 1};
  const LitLuminaire luminaire(device, StructuredLuminaire("grain", shape, kSamplingSeed));
  // 50 mm of support shrink to 0.25 texels of 7.5 mm, the middle of one.
  const auto point = RoundToFloat({{0.00375, 0.00375, 0.3113}, {0, 0, -1}});
  const std::vector<SurfacePoint> points(2000, point);
  const double exact = ExactLuminance(luminaire.field, {point})[0];
  const auto relative_rmse = [&](const char* name) {
    const auto lit = LightGBuffer(device, *MakeEstimator(name, device), MakeGBuffer(device, points),
                                  luminaire.on_device, WithSamples(1));
    double square = 0;
    for (const auto& e : lit.irradiance) square += std::pow(Luminance(e) / exact - 1, 2) / 2000;
    return std::sqrt(square);
  };
  const double basis = relative_rmse("basis"), windowed = relative_rmse("windowed"),
               uniform = relative_rmse("uniform");
  std::printf("relative RMSE of one sample: basis %.2e, windowed %.3f, uniform %.3f\n", basis,
              windowed, uniform);
  // n . (u - p) = z is the same for every u.
  EXPECT_LT(basis, 1e-5);
  EXPECT_LT(windowed, 0.5 * uniform);
  // 1.72 relative variance of Phi over its support (docs/theory.md 6.3).
  EXPECT_NEAR(uniform * uniform, 1.7225, 0.2);
}

// Averages of N passes of K samples converge as independent ones do: their mean is the truth and
// their variance that of one pass over N.
TEST(SamplingEstimators, PassesOfDifferentSeedsOrStreamsAreIndependent) {
  const Device device = Device::Open();
  const LitLuminaire luminaire(device, StructuredLuminaire("rings", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 64);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto exact = ExactLuminance(luminaire.field, points);
  constexpr int kPasses = 64, kGroup = 8;
  for (const auto& traits : EstimatorList()) {
    if (!traits.unbiased || traits.noise_free || !traits.needs.sat) continue;
    const auto estimator = MakeEstimator(traits.name, device);
    for (const bool by_seed : {true, false}) {
      std::vector<std::vector<double>> value(kPasses);
      for (int pass = 0; pass < kPasses; ++pass) {
        EstimatorOptions options = WithSamples(12);
        if (by_seed)
          options.seed += pass;
        else
          options.stream = static_cast<std::uint32_t>(pass);
        for (const auto& e :
             LightGBuffer(device, *estimator, gbuffer, luminaire.on_device, options).irradiance)
          value[pass].push_back(Luminance(e));
      }
      // Scatter of single passes against scatter of means over groups of passes.
      double single = 0, grouped = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        double mean = 0;
        for (int pass = 0; pass < kPasses; ++pass) mean += value[pass][k] / kPasses;
        for (int pass = 0; pass < kPasses; ++pass)
          single += std::pow((value[pass][k] - mean) / exact[k], 2) / (kPasses - 1);
        for (int group = 0; group < kPasses / kGroup; ++group) {
          double sum = 0;
          for (int pass = 0; pass < kGroup; ++pass) sum += value[group * kGroup + pass][k] / kGroup;
          grouped += std::pow((sum - mean) / exact[k], 2) / (kPasses / kGroup - 1);
        }
      }
      const double ratio = grouped * kGroup / single;
      std::printf("%s by %s: variance of means of %d over 1/%d of one pass: %.3f\n",
                  traits.name.c_str(), by_seed ? "seed" : "stream", kGroup, kGroup, ratio);
      // 64 pixels x 7 degrees of freedom: 5 standard deviations of sqrt(2 / 448), twice as wide for
      // the long tails of single pixels.
      EXPECT_NEAR(ratio, 1, traits.name == "precomputed" ? 1.0 : 0.67);
    }
  }
}

TEST(SamplingEstimators, OneLitTexelDarkImagesAndEightDecades) {
  const Device device = Device::Open();
  LuminaireShape shape;
  shape.width = shape.height = 30;
  auto one = EmptyLuminaire(shape), dark = EmptyLuminaire(shape), decades = EmptyLuminaire(shape);
  one.image(2, 0)[14 * 30 + 15] = 3e-5f;
  // Receivers that see the lit texel through the middle of its basis function: 64 samples have to
  // meet it.
  const auto many = FacingReceivers(0.3, 500, 0.1, 0.4);
  const auto light_of_one = ExactLuminance(one, many);
  const double most = *std::max_element(light_of_one.begin(), light_of_one.end());
  std::vector<SurfacePoint> points;
  for (std::size_t k = 0; k < many.size() && points.size() < 32; ++k)
    if (light_of_one[k] > 0.1 * most) points.push_back(many[k]);
  ASSERT_GT(points.size(), 8u);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  core::Random random(kSamplingSeed, 9);
  for (auto& c : decades.data) c = static_cast<float>(std::pow(10.0, -8 * random.Uniform()));
  const LitLuminaire lit_one(device, one), lit_dark(device, dark), lit_decades(device, decades);
  for (const auto& traits : EstimatorList()) {
    if (traits.noise_free || !traits.needs.sat) continue;
    const auto estimator = MakeEstimator(traits.name, device);
    const Lit nothing =
        LightGBuffer(device, *estimator, gbuffer, lit_dark.on_device, WithSamples(16));
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_EQ(nothing.irradiance[k].s[0], 0) << traits.name;
      EXPECT_EQ(nothing.samples[k], 0u) << traits.name;
    }
    if (!traits.unbiased) continue;
    for (const LitLuminaire* luminaire : {&lit_one, &lit_decades}) {
      const auto exact = ExactLuminance(luminaire->field, points);
      const auto options = WithSamples(traits.name == "precomputed" ? 4000 : 64);
      ExpectUnbiased(OverSeeds(device, *estimator, gbuffer, luminaire->on_device, options, 64),
                     exact, 64,
                     (traits.name + (luminaire == &lit_one ? " one texel" : " 8 decades")).c_str());
    }
  }
}

// Images of one value are separable: there the thesis' marginal is right, and with systematic
// allocation and a sequence of its own for every pixel and image so is its expectation.
TEST(Thesis, KnobsMakeItUnbiasedOnSeparableImages) {
  const Device device = Device::Open();
  const auto thesis = MakeEstimator("thesis", device);
  auto field = EmptyLuminaire({});
  std::fill(field.data.begin(), field.data.end(), 0.5f);
  const LitLuminaire luminaire(device, field);
  const auto points = FacingReceivers(0.3, 64);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  for (const char* sequence : {"sequence=halton", "sequence=sobol", "sequence=mersenne"})
    for (const char* inversion : {"inversion=bisection", "inversion=secant"}) {
      EstimatorOptions options = WithSamples(32);
      for (const char* knob :
           {"allocation=systematic", "correlation=decorrelated", sequence, inversion})
        options.knobs.Set(knob);
      ExpectUnbiased(OverSeeds(device, *thesis, gbuffer, luminaire.on_device, options, 64),
                     ExactLuminance(luminaire.field, points), 64, sequence);
    }
}

TEST(Thesis, SearchesEndAtTheSamePlaceAndDepthLimitsThem) {
  const Device device = Device::Open();
  const auto thesis = MakeEstimator("thesis", device);
  const LitLuminaire luminaire(
      device, StructuredLuminaire("facets", {.width = 160, .height = 120}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 64);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto light = [&](std::vector<const char*> knobs) {
    EstimatorOptions options = WithSamples(48);
    for (const char* knob : knobs) options.knobs.Set(knob);
    std::vector<double> out;
    for (const auto& e :
         LightGBuffer(device, *thesis, gbuffer, luminaire.on_device, options).irradiance)
      out.push_back(Luminance(e));
    return out;
  };
  const auto difference = [](const std::vector<double>& a, const std::vector<double>& b) {
    double square = 0, mean = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      square += std::pow(a[k] - b[k], 2);
      mean += b[k] * b[k];
    }
    return std::sqrt(square / mean);
  };
  const auto exact = light({"inversion=bisection"});
  EXPECT_LT(difference(light({"inversion=secant"}), exact), 1e-5);
  // Windows of at most 32 texels: six halvings reach one.
  EXPECT_LT(difference(light({"inversion=bisection", "depth=6"}), exact), 1e-5);
  double before = 1e9;
  for (const char* depth : {"depth=1", "depth=2", "depth=3"}) {
    const double now = difference(light({"inversion=bisection", depth}), exact);
    std::printf("bisection, %s: %.3f from the full search\n", depth, now);
    EXPECT_GT(now, 0);
    EXPECT_LT(now, before);
    before = now;
  }
  // One sequence for all pixels gives neighbours the same points; rotated ones do not.
  EXPECT_GT(difference(light({"correlation=decorrelated"}), exact), 1e-3);
  EXPECT_GT(difference(light({"allocation=systematic"}), exact), 1e-3);
}

TEST(Thesis, SequencesAreWhatTheirNamesSay) {
  const auto halton = MakeSequence(Sequence::kHalton, 8, 1);
  const double base2[] = {0.5, 0.25, 0.75, 0.125}, base3[] = {1 / 3., 2 / 3., 1 / 9., 4 / 9.};
  for (int k = 0; k < 4; ++k) {
    EXPECT_NEAR(std::ldexp(halton[k].s[0], -32), base2[k], 1e-9);
    EXPECT_NEAR(std::ldexp(halton[k].s[1], -32), base3[k], 1e-9);
  }
  const auto mersenne = MakeSequence(Sequence::kMersenne, 1000, 5489);
  // The 2000 words of MT19937's default seed; its 10000th is 4123659995 by the C++ standard.
  std::mt19937 judge;
  for (const auto& point : mersenne) {
    EXPECT_EQ(point.s[0], judge());
    EXPECT_EQ(point.s[1], judge());
  }
  // A (0, 8, 2)-net, scrambled: one point in every elementary interval.
  const auto sobol = MakeSequence(Sequence::kSobol, 256, 3);
  EXPECT_NE(sobol[0].s[0], 0u);
  for (int a = 0; a <= 8; ++a) {
    std::vector<int> hits(256, 0);
    for (const auto& p : sobol)
      ++hits[static_cast<int>(std::ldexp(p.s[0], a - 32)) * (1 << (8 - a)) +
             static_cast<int>(std::ldexp(p.s[1], -24 - a))];
    for (const int h : hits) EXPECT_EQ(h, 1) << a;
  }
}

TEST(EstimatorList, NamesMakeTheirEstimators) {
  const Device device = Device::Open();
  EXPECT_THROW(MakeEstimator("precise", device), InputError);
  for (const auto& traits : EstimatorList())
    EXPECT_EQ(MakeEstimator(traits.name, device)->traits().name, traits.name);
}

TEST(Knobs, AreReadCheckedAndPrinted) {
  Knobs knobs;
  knobs.Set("depth=3");
  knobs.Set("sequence=mersenne");
  knobs.Set("basis-share=0.125");
  EXPECT_EQ(knobs.Text(),
            "basis-share=0.125 brdf-share=0.5 allocation=rounded inversion=bisection depth=3 "
            "correlation=shared "
            "sequence=mersenne");
  for (const char* wrong : {"depth", "depth=-1", "depth=3x", "basis-share=1.5", "brdf-share=-1",
                            "basis-share=nan", "sequence=sobo", "colour=red", ""})
    EXPECT_THROW(knobs.Set(wrong), InputError) << wrong;
}

}  // namespace
}  // namespace luxfield::render
