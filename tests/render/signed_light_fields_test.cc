// Light fields with negative coefficients: every sampler stays unbiased, channel by channel, its
// contributions bounded; traced shadows of what has no noise hold where the light crosses 0.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "luxfield/render/estimators/mis.h"
#include "tests/render/brute_force.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

using lightfield::Basis;
using lightfield::BasisKind;
using lightfield::LightField;
using lightfield::Vec3;

constexpr std::uint64_t kSeed = kSamplingSeed;
constexpr int kSeeds = 64;

LightField Magnitudes(LightField field) {
  for (float& c : field.data) c = std::abs(c);
  return field;
}

// z-tests of every channel over the seeds. Sums of both signs cancel: what the light of |C| would
// be
// (`size`) is what rounding and outcomes too rare to be seen are parts of.
class ChannelSums {
 public:
  explicit ChannelSums(std::size_t pixels) : sum_(pixels), square_(pixels) {}

  void Add(const std::vector<cl_float4>& values) {
    for (std::size_t k = 0; k < values.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        sum_[k][c] += values[k].s[c];
        square_[k][c] += double{values[k].s[c]} * values[k].s[c];
      }
    ++seeds_;
  }

  void ExpectUnbiased(const std::vector<std::array<double, 3>>& exact,
                      const std::vector<std::array<double, 3>>& size, const std::string& what,
                      double unseen) const {
    double error = 0, variance = 0, t_square = 0;
    int values = 0;
    for (std::size_t k = 0; k < exact.size(); ++k)
      for (int c = 0; c < 3; ++c) {
        const double mean = sum_[k][c] / seeds_;
        const double spread =
            std::sqrt(std::max(0.0, square_[k][c] / seeds_ - mean * mean) / (seeds_ - 1));
        const double scatter = std::hypot(spread, (unseen + 1e-6) * size[k][c]);
        const double difference = mean - exact[k][c];
        if (size[k][c] == 0) {
          EXPECT_EQ(mean, 0) << what;
          continue;
        }
        error += difference;
        variance += scatter * scatter;
        t_square += std::pow(difference / scatter, 2);
        ++values;
      }
    const double expected = (seeds_ - 1.0) / (seeds_ - 3.0);
    std::printf("%s: pooled error %.2f standard errors, mean t^2 %.3f over %d (expected %.3f)\n",
                what.c_str(), error / std::sqrt(variance), t_square / values, values, expected);
    ASSERT_GT(values, 0) << what;
    // Channels of a pixel share its samples: three times the variance of independent ones.
    EXPECT_LT(std::abs(error), 3.5 * std::sqrt(3 * variance)) << what;
    EXPECT_LT(t_square / values, expected + 6 * std::sqrt(3 * 2.5 / values)) << what;
  }

 private:
  int seeds_ = 0;
  std::vector<std::array<double, 3>> sum_, square_;
};

std::vector<std::array<double, 3>> ExactChannels(const LightField& field,
                                                 const std::vector<SurfacePoint>& points) {
  std::vector<std::array<double, 3>> exact;
  for (const auto& [p, n] : points) exact.push_back(lightfield::ExactIrradiance(field, p, n));
  return exact;
}

// Luminance 0 of channels that are not: a density of luminances never draws them.
LightField WithoutLuminance(LightField field) {
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (std::size_t k = 0; k < field.geometry.plane_size(); ++k) {
      field.image(m, 0)[k] *= 0.7152f;
      field.image(m, 1)[k] = -field.image(m, 0)[k] * (0.2126f / 0.7152f);
      field.image(m, 2)[k] = 0;
    }
  return field;
}

void ExpectUnbiasedOverSeeds(const Device& device, Estimator& estimator, const LightField& field,
                             int samples, const std::string& what) {
  const auto points = FacingReceivers(0.3, 60);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const LitLuminaire luminaire(device, field);
  ChannelSums sums(points.size());
  for (int seed = 0; seed < kSeeds; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = samples;
    options.seed = kSeed + seed;
    sums.Add(LightGBuffer(device, estimator, gbuffer, luminaire.on_device, options).irradiance);
  }
  sums.ExpectUnbiased(ExactChannels(field, points), ExactChannels(Magnitudes(field), points), what,
                      1.0 / (kSeeds * samples));
}

LuminaireShape ShapeOf(BasisKind kind, int channels) {
  LuminaireShape shape;
  shape.basis = Basis::Make(kind);
  shape.channels = channels;
  return shape;
}

TEST(SignedLightFields, EverySamplerIsUnbiasedInEveryChannel) {
  std::printf("seeds from %llu\n", static_cast<unsigned long long>(kSeed));
  const Device device = Device::Open();
  for (const auto& traits : EstimatorList()) {
    if (!traits.unbiased || traits.noise_free) continue;
    const auto estimator = MakeEstimator(traits.name, device);
    const int samples = traits.name == "precomputed" ? 500 : 64;
    for (const int channels : {1, 3})
      ExpectUnbiasedOverSeeds(
          device, *estimator,
          WithSigns(StructuredLuminaire("facets", ShapeOf(BasisKind::kBspline2, channels), kSeed)),
          samples, traits.name + ", " + std::to_string(channels) + " channels");
    ExpectUnbiasedOverSeeds(
        device, *estimator,
        WithoutLuminance(StructuredLuminaire("facets", ShapeOf(BasisKind::kBspline2, 3), kSeed)),
        samples, traits.name + ", no luminance");
  }
}

TEST(SignedLightFields, CellsAreUnbiasedForEveryBasis) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  for (const auto kind : {BasisKind::kBox, BasisKind::kBilinear, BasisKind::kQuadratic})
    for (const char* structure : {"rings", "filament"})
      ExpectUnbiasedOverSeeds(device, *cells,
                              WithSigns(StructuredLuminaire(structure, ShapeOf(kind, 1), kSeed)),
                              24, Basis::Make(kind).name() + ", " + structure);
}

// Windows within a texel are drawn from the fit alone as long as it is the light; and on I itself.
TEST(SignedLightFields, CellsAreUnbiasedThroughOneTexel) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  LuminaireShape shape;
  shape.width = shape.height = 3;
  const LightField field = WithSigns(StructuredLuminaire("grain", shape, kSeed), 5);
  const LitLuminaire luminaire(device, field);
  std::vector<SurfacePoint> points;
  for (const double D : {0.0, 1e-6, 0.1, -0.1, 30.0})
    for (int k = 0; k < 12; ++k)
      points.push_back(RoundToFloat({{0.02 * (k % 4) - 0.031, 0.023 * (k / 4) - 0.02, 0.3 + D},
                                     Normalized(Vec3{0.1, 0.2, -1})}));
  const GBuffer gbuffer = MakeGBuffer(device, points);
  ChannelSums sums(points.size());
  for (int seed = 0; seed < kSeeds; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = 16;
    options.seed = kSeed + seed;
    sums.Add(LightGBuffer(device, *cells, gbuffer, luminaire.on_device, options).irradiance);
  }
  sums.ExpectUnbiased(ExactChannels(field, points), ExactChannels(Magnitudes(field), points),
                      "one texel", 1.0 / (kSeeds * 16));
}

TEST(SignedLightFields, MisIsUnbiased) {
  const Device device = Device::Open();
  MisEstimator two(device);
  const auto points = FacingReceivers(0.3, 60);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const LightField field =
      WithSigns(StructuredLuminaire("facets", ShapeOf(BasisKind::kBspline2, 1), kSeed));
  const LitLuminaire luminaire(device, field);
  for (const char* strategies : {"strategies=balance", "strategies=newton"}) {
    ChannelSums sums(points.size());
    for (int seed = 0; seed < kSeeds; ++seed) {
      EstimatorOptions options;
      options.samples_per_pixel = 64;
      options.seed = kSeed + seed;
      options.knobs.Set(strategies);
      Lighting lighting(device, gbuffer);
      two.Light({gbuffer}, PosedLuminaire{luminaire.on_device}, options, lighting);
      sums.Add(lighting.irradiance.Download<cl_float4>());
    }
    sums.ExpectUnbiased(ExactChannels(field, points), ExactChannels(Magnitudes(field), points),
                        strategies, 1.0 / (kSeeds * 64));
  }
}

// One sample of `cells` shows at most 40 q A in either direction (estimators/sampling_estimators.h).
TEST(SignedLightFields, ContributionsOfCellsAreBounded) {
  const Device device = Device::Open();
  const auto cells = MakeEstimator("cells", device);
  const LuminaireShape shape;
  const LitLuminaire luminaire(device, WithSigns(StructuredLuminaire("noise", shape, kSeed)));
  const auto points = FacingReceivers(0.3, 50);
  const GBuffer gbuffer = MakeGBuffer(device, points);
  const auto& g = luminaire.field.geometry;
  const double area = luminaire.cells.count() * shape.spacing_m * shape.spacing_m;
  double lowest = 0;
  for (int seed = 0; seed < 100; ++seed) {
    EstimatorOptions options;
    options.samples_per_pixel = 1;
    options.seed = kSeed + seed;
    const Lit lit = LightGBuffer(device, *cells, gbuffer, luminaire.on_device, options);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3 p = points[k].p;
      const double half = 0.5 * (shape.grid_width + 2) * shape.spacing_m;
      const double far = lightfield::Length({std::abs(p.x) + half, std::abs(p.y) + half, p.z});
      EXPECT_LE(std::abs(lit.irradiance[k].s[0]),
                40 * 9 * 1.5 * area * far * g.delta_m * g.delta_m / std::pow(p.z, 3));
      lowest = std::min(lowest, double{lit.irradiance[k].s[0]});
    }
  }
  EXPECT_LT(lowest, 0);
}

// Half of the lamp is hidden. `judge` is the light of the other half, by quadrature.
struct HalfHidden {
  std::vector<SurfacePoint> points;
  std::vector<double> judge, open, size;  // size: of the open light of |C|
};

HalfHidden HideHalf(const LightField& field) {
  HalfHidden half;
  half.points = FacingReceivers(field.geometry.delta_m, 60, 0.3, 3);
  const LightField magnitudes = Magnitudes(field);
  for (const auto& [p, n] : half.points) {
    double seen = 0, open = 0;
    VisitLight(field, p, 4, [&](double flux, Vec3 to_lamp) {
      const double light = flux * std::max(0.0, Dot(n, to_lamp));
      open += light;
      // Where the ray meets z = 0.1 mm: hidden for x > 0.
      const double x = p.x + to_lamp.x * (p.z - 1e-4) / p.z;
      if (x <= 0) seen += light;
    });
    half.judge.push_back(seen);
    half.open.push_back(open);
    half.size.push_back(lightfield::ExactIrradiance(magnitudes, p, n)[0]);
  }
  return half;
}

// C of alternating signs from image to image: the light of some receivers all but vanishes, and the
// ratio of what is seen to what there is means nothing there.
LightField Crossing() {
  LuminaireShape shape;
  LightField field = StructuredLuminaire("facets", shape, kSeed);
  for (int m = 0; m < field.geometry.grid.count(); ++m)
    for (float& c : field.image(m, 0)) c *= m % 2 ? -1.0f : 1.0f;
  return field;
}

TEST(SignedLightFields, TracedShadowsOfExactHoldWhereTheLightCrossesZero) {
  const Device device = Device::Open();
  const auto exact = MakeEstimator("exact", device), cells = MakeEstimator("cells", device);
  const LightField field = Crossing();
  const LitLuminaire luminaire(device, field);
  const HalfHidden half = HideHalf(field);
  const GBuffer gbuffer = MakeGBuffer(device, half.points);
  const auto blocker = Blocker(device, 0, 10, 1e-4f), all = Blocker(device, -10, 10, 1e-4f),
             none = Blocker(device, 20, 30, 1e-4f);
  const auto vanishing = [&](std::size_t k) { return std::abs(half.open[k]) < 0.2 * half.size[k]; };
  int crossing = 0;
  for (std::size_t k = 0; k < half.points.size(); ++k) crossing += vanishing(k);
  ASSERT_GT(crossing, 5);

  // Over seeds: the mean is the truth but for the covariance of v and the samples' sum, which the
  // product of their standard deviations bounds; the noise is about that of `cells` or below.
  constexpr int kSamples = 64;
  const auto over_seeds = [&](Estimator& estimator, double* worst) {
    std::vector<double> sum(half.points.size()), square(half.points.size()),
        stated(half.points.size());
    for (int seed = 0; seed < kSeeds; ++seed) {
      EstimatorOptions options;
      options.samples_per_pixel = kSamples;
      options.seed = kSeed + seed;
      const Lit lit =
          LightGBuffer(device, estimator, gbuffer, luminaire.on_device, options, blocker.get());
      for (std::size_t k = 0; k < half.points.size(); ++k) {
        const double value = lit.irradiance[k].s[0];
        sum[k] += value / kSeeds;
        square[k] += value * value / kSeeds;
        stated[k] += double{lit.variance[k]} / kSeeds;
        *worst = std::max(*worst, std::abs(value) / half.size[k]);
      }
    }
    double variance = 0, t_square = 0, reported = 0;
    for (std::size_t k = 0; k < half.points.size(); ++k) {
      const double spread = std::max(0.0, square[k] - sum[k] * sum[k]) * kSeeds / (kSeeds - 1);
      // The standard deviations of v size and of sum x are about that of the result.
      const double bias = spread / half.size[k], scatter = std::sqrt(spread / kSeeds + bias * bias);
      t_square +=
          std::pow((sum[k] - half.judge[k]) / scatter, 2) / static_cast<double>(half.points.size());
      variance += spread / (half.size[k] * half.size[k]);
      reported += stated[k] / (half.size[k] * half.size[k]);
    }
    std::printf("mean t^2 %.3f, relative variance %.3g, reported %.3g, worst %.3g\n", t_square,
                variance / static_cast<double>(half.points.size()),
                reported / static_cast<double>(half.points.size()), *worst);
    EXPECT_LT(t_square, 1.8);
    EXPECT_GT(reported, 0.8 * variance);
    return variance;
  };
  double worst_exact = 0, worst_cells = 0;
  const double by_ratio = over_seeds(*exact, &worst_exact),
               by_samples = over_seeds(*cells, &worst_cells);
  EXPECT_LT(by_ratio, 1.2 * by_samples);
  EXPECT_LT(worst_exact, 1);

  EstimatorOptions options;
  options.samples_per_pixel = 16;
  const Lit open = LightGBuffer(device, *exact, gbuffer, luminaire.on_device, options),
            clear = LightGBuffer(device, *exact, gbuffer, luminaire.on_device, options, none.get()),
            dark = LightGBuffer(device, *exact, gbuffer, luminaire.on_device, options, all.get());
  for (std::size_t k = 0; k < half.points.size(); ++k) {
    EXPECT_NEAR(clear.irradiance[k].s[0], open.irradiance[k].s[0], 1e-5 * half.size[k]);
    EXPECT_NEAR(dark.irradiance[k].s[0], 0, 1e-6 * half.size[k]);
    EXPECT_LT(clear.variance[k], 1e-10 * half.size[k] * half.size[k]);
  }
}

}  // namespace
}  // namespace luxfield::render
