#include "luxfield/bench/verbs/calibration_rows.h"

#include <gtest/gtest.h>

#include <vector>

namespace luxfield::bench {
namespace {

TEST(CalibrationRows, StateTheWorkOfOnePixel) {
  std::vector<render::CalibrationRun> runs(2);
  runs[0] = {"windowed",
             {.pixels = 8, .images = 24, .texels = 400, .samples = 128, .rays = 16},
             0.5,
             0.25};
  runs[1].estimator = "exact";  // nothing was hit
  const core::Json rows = CalibrationRows(runs);
  const core::Json expected = {{{"estimator", "windowed"},
                                {"pixels", 8.0},
                                {"images", 3.0},
                                {"texels", 50.0},
                                {"spp", 16.0},
                                {"rays", 2.0},
                                {"measured_s", 0.5},
                                {"predicted_s", 0.25}},
                               {{"estimator", "exact"},
                                {"pixels", 0.0},
                                {"images", 0.0},
                                {"texels", 0.0},
                                {"spp", 0.0},
                                {"rays", 0.0},
                                {"measured_s", 0.0},
                                {"predicted_s", 0.0}}};
  EXPECT_EQ(rows, expected);
}

}  // namespace
}  // namespace luxfield::bench
