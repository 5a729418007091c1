// The demo's judgement, on a lamp whose errors are known: a Lambertian square of two spacings, of
// which an ideal measurement with 6 x 6 filters of bspline2 keeps 102.2 % of the flux, whatever the
// lattice. (The projection of one axis is 1.0111 of the square's width; worked out by hand from
// Gram matrix and moments.)
#include "luxfield/planning/demo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "luxfield/core/file.h"
#include "tests/planning/demo_lab.h"
#include "tests/planning/lab_session.h"

namespace luxfield::planning {
namespace {

TEST(Demo, ErrorsAreAgainstTheLampAndNotItsProjection) {
  const ScratchFolder scratch("demo");
  const auto file = [&](const char* name) { return scratch.path() / name; };
  core::WriteFileAtomically(file("lab.toml"), kSquareLab);
  core::WriteFileAtomically(file("plan.toml"), kSquarePlan);
  core::WriteFileAtomically(file("scene.toml"), kWallScene);
  DemoOptions options;
  options.lab = file("lab.toml");
  options.plan = file("plan.toml");
  options.scene = file("scene.toml");
  options.folder = file("out");
  options.samples_per_pixel = 64;
  const DemoResult result = RunDemo(options);

  const auto& flux = result.flux;
  std::printf("flux: lamp %.2f +- %.2f, projection %+.3f %%, measured %+.3f %%\n", flux.lamp,
              flux.lamp_se, 100 * (flux.projection / flux.lamp - 1),
              100 * (flux.measured / flux.lamp - 1));
  // 12 Gauss nodes a cell meet the square's edges, which are knots: the projection is exact.
  EXPECT_NEAR(flux.projection / flux.lamp, 1.0222, 4 * flux.lamp_se / flux.lamp + 3e-4);
  EXPECT_LT(flux.lamp_se, 1e-3 * flux.lamp);

  EXPECT_NEAR(flux.measured / flux.lamp, 1, 1e-3);  // of an ideal lab, whose solve keeps it
  for (const DemoStage& stage : result.stages)
    std::printf("%-12s lamp %.5f projection %.6f\n", stage.name.c_str(), stage.error.rel_rmse,
                stage.projection.rel_rmse);
  // The filters see the lamp as it is.
  EXPECT_LT(result.stages[1].error.rel_rmse, 2e-3);
  EXPECT_LT(result.stages[1].projection.rel_rmse, 2e-3);
  // Far away the square is a point, whose light is its flux: right of what was measured, but for
  // texels of 22 mm, over which cos^4 changes by 5 %, and the C >= 0 that light the picture; and
  // 2.2 % too much of the projection.
  const DemoStage& render = result.stages[4];
  EXPECT_LT(render.error.rel_l2, 0.01);
  EXPECT_NEAR(render.projection.rel_l2, 0.0222, 6e-3);
  EXPECT_LT(result.floor_irradiance.rel_l2, 7e-3);
  // Edges that the basis does not hold: the radiance's floor is far above all of this.
  EXPECT_GT(result.floor.rel_l2, 0.1);
  EXPECT_GT(result.stages[2].error.rel_l2, result.floor.rel_l2);
  EXPECT_LT(result.stages[2].error.rel_l2, 1.1 * result.floor.rel_l2);
  EXPECT_LE(result.pictures.floor.mean_lab, result.pictures.lamp.mean_lab + 0.01);
  EXPECT_LT(result.pictures.lamp.mean_lab, result.pictures.projection.mean_lab);
  EXPECT_GT(result.pictures.shadowed.rel_rmse, result.pictures.lamp.rel_rmse);  // its samples
  EXPECT_LT(result.pictures.reference.rel_rmse, 0.005);
}

}  // namespace
}  // namespace luxfield::planning
