// Two small headlights with soft shadow maps: near the traced truth, and no popping where they move.
#include "luxfield/bench/bench_soft_shadows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

SoftShadowsOptions Small() {
  SoftShadowsOptions options;
  options.lamp.size = 64;
  options.width = 128;
  options.height = 96;
  options.repeats = 1;
  options.reference_pixels = 1500;
  options.reference_samples = 512;
  return options;
}

TEST(BenchSoftShadows, PicturesAreNearTheTruthAndMoveAsItDoes) {
  auto options = Small();
  options.motion_frames = options.flight_frames = 4;
  options.motion_pixels = 500;
  const SoftShadowsFigures figures = MeasureSoftShadows(options);
  const auto row = SoftShadowsRow(options, figures);
  std::printf("%s\n", row.dump().c_str());
  EXPECT_LT(5 * figures.reference_lab, figures.unshadowed_lab);
  EXPECT_LT(figures.mean_lab, 1.2);  // the thesis' figure for 49 maps
  EXPECT_LT(5 * figures.mean_lab, figures.unshadowed_lab);
  EXPECT_LT(std::abs(figures.bias), 0.02);
  EXPECT_GT(figures.fps, 0);
  // Errors that have nothing to do with each other from frame to frame would change by sqrt(2) of
  // their size: nothing pops.
  for (const MotionFigures& of : {figures.motion, figures.flight}) {
    EXPECT_GT(of.lab, 0.5 * of.reference_lab);
    EXPECT_LT(of.error_lab, 1.5 * figures.mean_lab);
    EXPECT_NEAR(of.excess_lab, of.lab - of.reference_lab, 1e-9);
    EXPECT_GE(of.largest_excess_lab, of.excess_lab);
    EXPECT_LT(of.largest_excess_lab, figures.mean_lab);
  }
  EXPECT_NE(figures.flight.reference_lab, figures.motion.reference_lab);
}

TEST(BenchSoftShadows, RefusesWhatMakesNoSense) {
  for (int SoftShadowsOptions::*count :
       {&SoftShadowsOptions::width, &SoftShadowsOptions::height, &SoftShadowsOptions::repeats,
        &SoftShadowsOptions::reference_pixels, &SoftShadowsOptions::motion_pixels}) {
    auto options = Small();
    options.*count = 0;
    EXPECT_THROW(MeasureSoftShadows(options), InputError);
  }
  auto options = Small();
  options.reference_samples = 1;
  EXPECT_THROW(MeasureSoftShadows(options), InputError);
  options = Small();
  options.map_size = 5000;
  EXPECT_THROW(MeasureSoftShadows(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
