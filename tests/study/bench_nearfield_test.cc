// The near-field bench on a small headlight: its rows say what they must, and its judge agrees with
// `exact`.
#include "study/bench_nearfield.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace luxfield::study {
namespace {

BenchNearfieldOptions Small() {
  BenchNearfieldOptions options;
  options.car2 = {.grid_width = 4, .grid_height = 3, .size = 64, .channels = 3};
  options.width = 64;
  options.height = 48;
  options.samples_per_pixel = {16, 256};
  options.repeats = 1;
  options.reference_pixels = 0;
  return options;
}

TEST(BenchNearfield, RowsHaveEveryKeyAndExactIsExact) {
  const auto rows = BenchNearfield(Small());
  ASSERT_EQ(rows.size(), 6u);  // exact; volume; windowed and thesis at two sample counts
  for (const auto& row : rows) {
    for (const char* key :
         {"scene", "estimator", "spp", "width", "height", "images", "channels", "threads",
          "build_core_s", "fps", "core_s", "rel_rmse", "mean_lab", "bias"})
      EXPECT_TRUE(row.contains(key)) << key;
    EXPECT_GT(row["fps"].get<double>(), 0);
    EXPECT_EQ(row["images"], 12);
    EXPECT_EQ(row["channels"], 3);
  }
  EXPECT_EQ(rows[0]["estimator"], "exact");
  EXPECT_EQ(rows[0]["spp"], 0);
  EXPECT_LT(rows[0]["rel_rmse"].get<double>(), 1e-5);
  EXPECT_LT(rows[0]["mean_lab"].get<double>(), 1e-2);
  EXPECT_EQ(rows[1]["estimator"], "volume");
  EXPECT_EQ(rows[1]["spp"], 0);
  EXPECT_GT(rows[1]["build_core_s"].get<double>(), 0);
  EXPECT_LT(rows[1]["rel_rmse"].get<double>(), 2.5e-3);  // built for 2e-3
  EXPECT_EQ(rows[2]["estimator"], "windowed");
  // Sixteen times the samples: at least half the error (a quarter or less is expected).
  EXPECT_LT(rows[3]["rel_rmse"].get<double>(), 0.5 * rows[2]["rel_rmse"].get<double>());
  EXPECT_LT(std::abs(rows[3]["bias"].get<double>()), 0.02);
}

TEST(BenchNearfield, RefusesWhatMakesNoSense) {
  auto options = Small();
  options.estimators = {"guess"};
  EXPECT_THROW(BenchNearfield(options), InputError);
  options = Small();
  options.width = 0;
  EXPECT_THROW(BenchNearfield(options), InputError);
  options = Small();
  options.car2.channels = 2;
  EXPECT_THROW(BenchNearfield(options), InputError);
}

}  // namespace
}  // namespace luxfield::study
