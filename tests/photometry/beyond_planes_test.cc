// The bound on light that crosses F but nothing known of I.
#include "luxfield/photometry/beyond_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "luxfield/photometry/functional.h"
#include "tests/photometry/lamps.h"

namespace luxfield::photometry {
namespace {

// A disc's is pi R^2 / (R^2 + delta^2); a midpoint rule over the rectangle for one that is off the axis.
TEST(BeyondPlanes, ProjectedSolidAngleIsTheIntegralOfCosines) {
  EXPECT_NEAR(ProjectedSolidAngle(-1e6, 1e6, -1e6, 1e6, 1), std::numbers::pi, 1e-5);
  const double s0 = 0.2, s1 = 0.9, t0 = -0.5, t1 = 0.1, delta = 0.3;
  constexpr int kSteps = 400;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double x = s0 + (s1 - s0) * (i + 0.5) / kSteps, y = t0 + (t1 - t0) * (j + 0.5) / kSteps;
      const double r2 = x * x + y * y + delta * delta;
      sum += delta * delta / (r2 * r2) * (s1 - s0) * (t1 - t0) / kSteps / kSteps;
    }
  EXPECT_NEAR(ProjectedSolidAngle(s0, s1, t0, t1, delta), sum, 1e-5 * sum);
}

// A Lambertian square behind an I that is cut: all of its light, pi L A, is what was seen and what the
// bound says, as its radiance is the same everywhere.
TEST(BeyondPlanes, IsWhatALambertianLampHidesThere) {
  for (const double half_width : {0.03, 0.1, 0.3}) {
    const Lamp lamp = LampOfField(LambertianSquare::Field(8, 13, half_width));
    const double all = std::numbers::pi * LambertianSquare::kRadiance * LambertianSquare::kSide *
                       LambertianSquare::kSide;
    const double seen = Value(lamp, FluxOf(lamp));
    EXPECT_NEAR(FluxBeyondPlanesBound(lamp), all - seen, 2e-3 * all) << half_width;
  }
  EXPECT_EQ(FluxBeyondPlanesBound(LampOfField(lightfield::LightField(SmoothField().geometry))), 0);
}

}  // namespace
}  // namespace luxfield::photometry
