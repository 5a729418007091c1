// The first-order effect of planes that are not parallel against integrals over the tilted filter.
#include "luxfield/reconstruct/merge/tilt_effect.h"

#include <gtest/gtest.h>

#include <cmath>

namespace luxfield::reconstruct {
namespace {

using lightfield::Vec2;

constexpr double kDelta_m = 0.3, kSpacing_m = 0.0165;

SessionPlan Plan(Vec2 tilt_rad, Vec2 slopes) {
  SessionPlan plan;
  plan.geometry.delta_m = kDelta_m;
  plan.geometry.grid = lightfield::BasisGrid::Centred(
      lightfield::Basis::Make(lightfield::BasisKind::kBspline2), 3, 2, kSpacing_m);
  plan.geometry.lattice = {8, 6, -0.16, 0.12, 0.04, 0.04};
  plan.tilts = {tilt_rad, slopes, 1.5e-5, 3e-5};
  return plan;
}

// E on I at q behind a filter of axes Ry(b) Rx(a) that is evenly lit, L = 1: flux from its elements
// by the angles at both ends.
double Irradiance(const lightfield::Basis& basis, double a, double b, Vec2 q) {
  constexpr int kSteps = 40;
  const double step_m = basis.cells * kSpacing_m / kSteps;
  double sum = 0;
  for (int j = 0; j < kSteps; ++j)
    for (int i = 0; i < kSteps; ++i) {
      const double x = (i + 0.5 - 0.5 * kSteps) * step_m, y = (j + 0.5 - 0.5 * kSteps) * step_m;
      const double along_u = x * std::cos(b) + y * std::sin(a) * std::sin(b),
                   along_v = y * std::cos(a),
                   ahead = -x * std::sin(b) + y * std::sin(a) * std::cos(b);
      const double dx = q.x - along_u, dy = q.y - along_v, dz = kDelta_m - ahead;
      const double facing =
          dx * std::cos(a) * std::sin(b) - dy * std::sin(a) + dz * std::cos(a) * std::cos(b);
      const double r2 = dx * dx + dy * dy + dz * dz;
      sum += basis.Value(x / kSpacing_m + 1.5) * basis.Value(y / kSpacing_m + 1.5) * dz * facing /
             (r2 * r2);
    }
  return sum * step_m * step_m;
}

TEST(TiltEffect, IsThatOfIntegralsOverATiltedFilter) {
  for (const Vec2 tilt : {Vec2{0.01, 0}, Vec2{0, 0.01}, Vec2{-0.006, 0.008}}) {
    const SessionPlan plan = Plan(tilt, {});
    const auto& [grid, lattice] = std::pair(plan.geometry.grid, plan.geometry.lattice);
    double worst = 0;
    for (int m = 0; m < grid.count(); ++m)
      for (int p = 0; p < lattice.width * lattice.height; ++p) {
        const Vec2 q = lattice.centre(p / lattice.width, p % lattice.width) -
                       grid.centre(m % grid.width, m / grid.width);
        const double tilted = Irradiance(grid.basis, tilt.x, tilt.y, q),
                     flat = Irradiance(grid.basis, 0, 0, q);
        worst = std::max(worst, std::abs(tilted / flat - 1));
      }
    const TiltEffect effect = EffectOfTilts(plan);
    // Second order, and what the filter's own extent adds.
    EXPECT_NEAR(effect.light / worst, 1, 0.03) << tilt.x << ' ' << tilt.y;
    EXPECT_EQ(effect.displacement, 0);
    EXPECT_TRUE(effect.BeyondStated());
  }
}

TEST(TiltEffect, OfASlopeIsWhereRaysPassTheFilter) {
  // At the outermost position the filter is 2e-4 m nearer; a ray from its middle to the farthest
  // texel's centre passes F beside it.
  const double slope = 2e-4 / kSpacing_m;
  const SessionPlan plan = Plan({}, {slope, 0});
  const Vec2 c = plan.geometry.grid.centre(0, 0), q = plan.geometry.lattice.centre(0, 7) - c;
  const TiltEffect effect = EffectOfTilts(plan);
  EXPECT_EQ(effect.light, 0);
  EXPECT_NEAR(effect.displacement, 2e-4 * std::hypot(q.x, q.y) / kDelta_m / kSpacing_m, 1e-12);
  EXPECT_TRUE(effect.BeyondStated());
  EXPECT_NEAR(effect.stated_light, 1e-4, 1e-12);
}

TEST(TiltEffect, WithinWhatTheCalibrationStatesIsSaidToBe) {
  const TiltEffect small = EffectOfTilts(Plan({1e-5, -2e-5}, {1e-5, 0})),
                   large = EffectOfTilts(Plan({0.01, 0}, {}));
  EXPECT_FALSE(small.BeyondStated());
  EXPECT_EQ(TextOf(small).find("shim"), std::string::npos);
  EXPECT_NE(TextOf(large).find("more than the calibration's own uncertainty (0.01 %"),
            std::string::npos)
      << TextOf(large);
}

}  // namespace
}  // namespace luxfield::reconstruct
