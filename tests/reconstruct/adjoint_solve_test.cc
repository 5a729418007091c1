#include "luxfield/reconstruct/solve/adjoint_solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/random.h"
#include "luxfield/reconstruct/solve/reconstruct.h"

namespace luxfield::reconstruct {
namespace {

using lightfield::FilterKind;

constexpr std::uint64_t kSeed = 5;

lightfield::Measurements RandomMeasurements(FilterKind filter, bool incomplete) {
  lightfield::Measurements m;
  m.filter = filter;
  m.geometry.delta_m = 0.3;
  m.geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(filter == FilterKind::kDual ? lightfield::BasisKind::kQuadratic
                                                          : lightfield::BasisKind::kBspline2),
      4, 3, 0.02);
  m.geometry.lattice = {5, 4, -0.05, 0.04, 0.02, 0.02};
  m.geometry.channels = 3;
  core::Random random(kSeed, incomplete);
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const std::size_t texels = m.geometry.plane_size();
  for (int k = 0; k < m.geometry.grid.count(); ++k) {
    auto& position = m.positions.emplace_back();
    for (std::size_t p = 0; p < texels; ++p) {
      // Columns that fall off the sensor at one side, and a few gaps.
      const bool off = k % 4 == 3 && p % 5 > 2, gap = random.Uniform() < 0.05;
      position.mask.push_back(incomplete && (off || gap) ? std::uint32_t{lightfield::kOffSensor}
                                                         : 0u);
    }
    for (std::size_t p = 0; p < texels * 3; ++p) {
      const bool unknown = position.mask[p % texels] != 0;
      position.irradiance.push_back(unknown ? 0 : static_cast<float>(random.Uniform()));
      position.sigma.push_back(unknown ? 0 : 0.01f);
    }
    position.count.assign(texels, 1);
  }
  return m;
}

// sum w E = sum q C for any q; E and C are float32, the solve in double.
class AdjointSolveTest : public testing::TestWithParam<FilterKind> {};

TEST_P(AdjointSolveTest, IsTheTransposeOfTheSolve) {
  for (const bool incomplete : {false, true}) {
    const auto measurements = RandomMeasurements(GetParam(), incomplete);
    ReconstructOptions options;
    options.precision = Precision::kDouble;
    const Reconstruction solved = Reconstruct(measurements, options);
    EXPECT_EQ(solved.report.incomplete.incomplete > 0, incomplete);
    EXPECT_EQ(solved.report.incomplete.with_gaps > 0,
              incomplete && GetParam() == FilterKind::kBasis);
    lightfield::Weights q(solved.coefficients.data.size());
    core::Random random(kSeed, 2);
    for (double& x : q) x = random.Uniform() - 0.5;
    const lightfield::Weights w = AdjointSolve(measurements, q);
    double by_irradiance = 0, scale = 0;
    const std::size_t values = measurements.geometry.plane_size() * 3;
    for (std::size_t k = 0; k < w.size(); ++k) {
      const auto& position = measurements.positions[k / values];
      const double term = w[k] * position.irradiance[k % values];
      by_irradiance += term;
      scale += std::abs(term);
      if (position.mask[k % values % measurements.geometry.plane_size()]) {
        EXPECT_EQ(w[k], 0);
      }
    }
    EXPECT_NEAR(by_irradiance, lightfield::Apply(q, solved.coefficients), 1e-6 * scale);
  }
}

INSTANTIATE_TEST_SUITE_P(Filters, AdjointSolveTest,
                         testing::Values(FilterKind::kBasis, FilterKind::kDual));

}  // namespace
}  // namespace luxfield::reconstruct
