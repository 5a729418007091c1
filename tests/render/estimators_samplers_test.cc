// What every unbiased sampling estimator keeps: streams, seeds, tiles, batches and work-groups are
// what they say; samples are counted; the variance it reports covers its scatter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "luxfield/core/error.h"
#include "tests/render/sampling_fixture.h"

namespace luxfield::render {
namespace {

class Samplers : public testing::TestWithParam<std::string> {
 protected:
  std::vector<cl_float4> Light(const std::vector<SurfacePoint>& points,
                               const LuminaireOnDevice& luminaire,
                               const EstimatorOptions& options) {
    return LightGBuffer(device_, *estimator_, MakeGBuffer(device_, points), luminaire, options)
        .irradiance;
  }

  const Device device_ = Device::Open();
  const std::unique_ptr<Estimator> estimator_ = MakeEstimator(GetParam(), device_);
};

bool SameLight(const cl_float4& a, const cl_float4& b) { return std::equal(a.s, a.s + 3, b.s); }

TEST_P(Samplers, StreamsSeedsAndTilesAreWhatTheySay) {
  const LitLuminaire luminaire(device_, StructuredLuminaire("rings", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 96);
  EstimatorOptions options;
  options.samples_per_pixel = 16;
  const auto whole = Light(points, luminaire.on_device, options);
  const auto again = [&](const EstimatorOptions& other) {
    return std::ranges::equal(Light(points, luminaire.on_device, other), whole, SameLight);
  };
  EXPECT_TRUE(again(options));
  EstimatorOptions of_tile = options, of_stream = options, of_seed = options;
  of_tile.first_pixel = 40;
  const auto tile = Light({points.begin() + 40, points.end()}, luminaire.on_device, of_tile);
  for (std::size_t k = 0; k < tile.size(); ++k) EXPECT_TRUE(SameLight(tile[k], whole[k + 40])) << k;
  of_stream.stream = 1;
  EXPECT_FALSE(again(of_stream));
  of_seed.seed += std::uint64_t{1} << 40;
  EXPECT_FALSE(again(of_seed));
}

// More pixels than one batch of scratch memory takes: their light is that of a tile of their own.
TEST_P(Samplers, BatchesDoNotMatter) {
  LuminaireShape shape;
  shape.grid_width = shape.grid_height = 7;
  shape.width = shape.height = 8;
  const LitLuminaire luminaire(device_, StructuredLuminaire("rings", shape, kSamplingSeed));
  constexpr std::size_t kPixels = 24000, kTail = 500;
  const auto some = FacingReceivers(0.3, kTail);
  std::vector<SurfacePoint> points;
  while (points.size() < kPixels) points.insert(points.end(), some.begin(), some.end());
  EstimatorOptions options;
  options.samples_per_pixel = 1;
  const auto whole = Light(points, luminaire.on_device, options);
  options.first_pixel = kPixels - kTail;
  const auto tail = Light(some, luminaire.on_device, options);
  for (std::size_t k = 0; k < kTail; ++k)
    EXPECT_TRUE(SameLight(tail[k], whole[kPixels - kTail + k])) << k;
}

TEST_P(Samplers, WorkGroupSizeDoesNotMatter) {
  const auto field = StructuredLuminaire("rings", {}, kSamplingSeed);
  const auto points = FacingReceivers(0.3, 100);
  std::vector<cl_float4> first;
  for (const char* group : {"group=1", "group=7", "group=64", "group=128"}) {
    const Device cut = device_.WithTuning(ParseTuning(group, device_.tuning()));
    const LitLuminaire luminaire(cut, field);
    const auto lit = LightGBuffer(cut, *MakeEstimator(GetParam(), cut), MakeGBuffer(cut, points),
                                  luminaire.on_device)
                         .irradiance;
    if (first.empty()) first = lit;
    EXPECT_TRUE(std::ranges::equal(lit, first, SameLight)) << group;
    EXPECT_TRUE(std::ranges::any_of(lit, [](const cl_float4& e) { return e.s[1] > 0; })) << group;
  }
}

TEST_P(Samplers, TakeExactlyKSamplesAndNoneInTheDark) {
  const LitLuminaire luminaire(device_, StructuredLuminaire("noise", {}, kSamplingSeed));
  auto points = FacingReceivers(0.3, 60);
  points.push_back({{0, 0, -1}, {0, 0, 1}});      // behind
  if (GetParam() != "precomputed")                // which draws without looking
    points.push_back({{500, 0, 1}, {-1, 0, 0}});  // every window off the image
  const GBuffer gbuffer = MakeGBuffer(device_, points);
  for (const int samples : {1, 7, 200}) {
    EstimatorOptions options;
    options.samples_per_pixel = samples;
    const Lit lit = LightGBuffer(device_, *estimator_, gbuffer, luminaire.on_device, options);
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_EQ(lit.samples[k], k < 60 ? static_cast<cl_uint>(samples) : 0u) << k;
      if (k >= 60) {
        EXPECT_EQ(lit.irradiance[k].s[0], 0);
      }
    }
  }
}

TEST_P(Samplers, ReportedVarianceCoversTheScatter) {
  const LitLuminaire luminaire(device_, StructuredLuminaire("facets", {}, kSamplingSeed));
  const auto points = FacingReceivers(0.3, 60);
  EstimatorOptions options;
  options.samples_per_pixel = GetParam() == "precomputed" ? 2000 : 64;
  const auto statistics = OverSeeds(device_, *estimator_, MakeGBuffer(device_, points),
                                    luminaire.on_device, options, 64);
  double scatter = 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    scatter +=
        64 * std::pow(statistics.standard_error[k], 2) / statistics.reported_variance[k] / 60;
  std::printf("%s: scatter / reported variance %.2f\n", GetParam().c_str(), scatter);
  // Samples taken as independent: stratification leaves less, by much where windows are smooth.
  EXPECT_LT(scatter, 1.1);
  EXPECT_GT(scatter, 0.02);
}

TEST_P(Samplers, BadOptionsAndMissingTablesAreRefused) {
  const LitLuminaire luminaire(device_, StructuredLuminaire("rings", {}, kSamplingSeed));
  const LuminaireOnDevice bare(device_, luminaire.field);
  const auto points = FacingReceivers(0.3, 2);
  EXPECT_THROW(Light(points, bare, {}), InputError);
  EstimatorOptions options;
  options.samples_per_pixel = 0;
  EXPECT_THROW(Light(points, luminaire.on_device, options), InputError);
  options.samples_per_pixel = 8;
  options.max_samples_per_image = -1;
  EXPECT_THROW(Light(points, luminaire.on_device, options), InputError);
}

std::vector<std::string> UnbiasedSamplers() {
  std::vector<std::string> names;
  for (const auto& traits : EstimatorList())
    if (traits.unbiased && !traits.noise_free) names.push_back(traits.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Estimators, Samplers, testing::ValuesIn(UnbiasedSamplers()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace luxfield::render
