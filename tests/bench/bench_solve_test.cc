#include "luxfield/bench/bench_solve.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

TEST(BenchSolve, ReportsItsRows) {
  nlohmann::json rows = BenchSolve({4, 3, 16, 3, 2});
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0]["case"], "12 images 16 x 16 x 3, float");
  const nlohmann::json non_negative = rows.back();
  rows.erase(3);
  EXPECT_TRUE(non_negative.contains("error"));
  for (const auto& row : rows) {
    const double wall_s = row["wall_s"], gb_per_s = row["gb_per_s"];
    EXPECT_GT(wall_s, 0);
    EXPECT_GT(row["copy_ratio"].get<double>(), 0);
    const int bytes = row["case"] == "12 images 16 x 16 x 3, double" ? 8 : 4;
    EXPECT_NEAR(wall_s * gb_per_s * 1e9, 2.0 * 12 * 16 * 16 * 3 * bytes, 1);
  }
}

TEST(BenchSolve, NonNegativeBeatsClamping) {
  // 63 images, noise of 0.3 % of the largest E; seeded in the bench.
  BenchSolveOptions options{9, 7, 24, 1, 1};
  options.noise = 3e-3;
  const nlohmann::json row = BenchSolve(options).back();
  EXPECT_EQ(row["case"], "63 images 24 x 24 x 1, non-negative");
  EXPECT_LE(row["kkt_residual"].get<double>(), 1e-5);
  EXPECT_LT(row["clamped_error"].get<double>(), row["signed_error"].get<double>());
  EXPECT_LT(row["error"].get<double>(), row["clamped_error"].get<double>());
}

TEST(BenchSolve, RefusesNothing) { EXPECT_THROW(BenchSolve({4, 3, 0, 3, 2}), InputError); }

}  // namespace
}  // namespace luxfield::bench
