// What tests of sampling estimators share: a lit luminaire, receivers, z-tests over seeds.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_vector.h"
#include "luxfield/preprocess/tables.h"
#include "tests/render/estimator_fixture.h"
#include "tests/render/structured_luminaires.h"

namespace luxfield::render {

inline constexpr std::uint64_t kSamplingSeed = 20140202;

struct LitLuminaire {
  lightfield::LightField field;
  preprocess::Tables tables;
  preprocess::CellTables cells;
  LuminaireOnDevice on_device;

  LitLuminaire(const Device& device, const lightfield::LightField& f)
      : field(f),
        tables(preprocess::BuildTables(field, "test.lf.exr", std::string(64, '0'))),
        cells(preprocess::BuildCellTables(field, "test.lf.exr")),
        on_device(device, field, {.sat = &tables, .cells = &cells}) {}
};

inline std::vector<SurfacePoint> FacingReceivers(double delta, int count, double near = 0.2,
                                                 double far = 4) {
  core::Random random(kSamplingSeed, 3);
  std::vector<SurfacePoint> points;
  for (int k = 0; k < count; ++k) {
    const double D = near * std::pow(far / near, random.Uniform());
    const lightfield::Vec3 p{0.2 * (delta + D) * (random.Uniform() - 0.5),
                             0.2 * (delta + D) * (random.Uniform() - 0.5), delta + D};
    points.push_back(
        RoundToFloat({p, Normalized(lightfield::Vec3{random.Uniform() - 0.5, random.Uniform() - 0.5,
                                                     -0.3 - random.Uniform()})}));
  }
  return points;
}

inline double Luminance(const std::array<double, 3>& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}
inline double Luminance(const cl_float4& c) {
  return 0.2126 * c.s[0] + 0.7152 * c.s[1] + 0.0722 * c.s[2];
}

inline std::vector<double> ExactLuminance(const lightfield::LightField& field,
                                          const std::vector<SurfacePoint>& points) {
  std::vector<double> exact;
  for (const auto& [p, n] : points)
    exact.push_back(Luminance(lightfield::ExactIrradiance(field, p, n)));
  return exact;
}

struct SeedStatistics {
  std::vector<double> mean, standard_error, reported_variance;
};

// Sums over seeds, pixel by pixel.
class SeedSums {
 public:
  explicit SeedSums(std::size_t pixels) : sum_(pixels), square_(pixels), reported_(pixels) {}

  void Add(const std::vector<cl_float4>& values, const std::vector<float>& variance) {
    for (std::size_t k = 0; k < sum_.size(); ++k) {
      const double value = Luminance(values[k]);
      sum_[k] += value;
      square_[k] += value * value;
      reported_[k] += double{variance[k]};
    }
    ++seeds_;
  }
  SeedStatistics Statistics() const {
    SeedStatistics statistics;
    for (std::size_t k = 0; k < sum_.size(); ++k) {
      const double mean = sum_[k] / seeds_;
      statistics.mean.push_back(mean);
      statistics.standard_error.push_back(
          std::sqrt(std::max(0.0, square_[k] / seeds_ - mean * mean) / (seeds_ - 1)));
      statistics.reported_variance.push_back(reported_[k] / seeds_);
    }
    return statistics;
  }

 private:
  int seeds_ = 0;
  std::vector<double> sum_, square_, reported_;
};

inline SeedStatistics OverSeeds(const Device& device, Estimator& estimator, const GBuffer& gbuffer,
                                const LuminaireOnDevice& luminaire, EstimatorOptions options,
                                int seeds, const RayScene* rays = nullptr) {
  SeedSums sums(gbuffer.pixel_count());
  for (int seed = 0; seed < seeds; ++seed) {
    options.seed = kSamplingSeed + seed;
    const Lit lit = LightGBuffer(device, estimator, gbuffer, luminaire, options, rays);
    sums.Add(lit.irradiance, lit.variance);
  }
  return sums.Statistics();
}

// |sum of errors| in pooled standard errors, and the mean of squared t over the pixels
// (1 + 2 / (seeds - 3) expected). Outcomes rarer than one in all samples do not show in the spread
// over the seeds: `unseen` is the part of the light that they may hold.
inline void ExpectUnbiased(const SeedStatistics& statistics, const std::vector<double>& exact,
                           int seeds, const char* what, double unseen = 0) {
  double error = 0, variance = 0, t_square = 0;
  int pixels = 0;
  for (std::size_t k = 0; k < exact.size(); ++k) {
    if (statistics.standard_error[k] == 0) {
      EXPECT_NEAR(statistics.mean[k], exact[k], 1e-5 * std::abs(exact[k])) << what;
      continue;
    }
    const double difference = statistics.mean[k] - exact[k],
                 scatter = std::hypot(statistics.standard_error[k], unseen * exact[k]);
    error += difference;
    variance += scatter * scatter;
    t_square += std::pow(difference / scatter, 2);
    ++pixels;
  }
  const double expected = (seeds - 1.0) / (seeds - 3.0);
  std::printf(
      "%s: pooled error %.2f standard errors, mean t^2 %.3f over %d pixels (expected %.3f)\n", what,
      error / std::sqrt(variance), t_square / pixels, pixels, expected);
  EXPECT_GT(pixels, 0);
  EXPECT_LT(std::abs(error), 3 * std::sqrt(variance)) << what;
  // The variance of t^2 is about 2.3 at 64 seeds; six standard deviations of its mean.
  EXPECT_LT(t_square / pixels, expected + 6 * std::sqrt(2.5 / pixels)) << what;
}

}  // namespace luxfield::render
