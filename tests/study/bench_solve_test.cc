#include "study/bench_solve.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/error.h"

namespace luxfield::study {
namespace {

TEST(BenchSolve, ReportsItsRows) {
  const nlohmann::json rows = BenchSolve({4, 3, 16, 3, 2});
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0]["case"], "12 images 16 x 16 x 3, float");
  for (const auto& row : rows) {
    const double wall_s = row["wall_s"], gb_per_s = row["gb_per_s"];
    EXPECT_GT(wall_s, 0);
    EXPECT_GT(row["copy_ratio"].get<double>(), 0);
    const int bytes = row["case"] == "12 images 16 x 16 x 3, double" ? 8 : 4;
    EXPECT_NEAR(wall_s * gb_per_s * 1e9, 2.0 * 12 * 16 * 16 * 3 * bytes, 1);
  }
}

TEST(BenchSolve, RefusesNothing) { EXPECT_THROW(BenchSolve({4, 3, 0, 3, 2}), InputError); }

}  // namespace
}  // namespace luxfield::study
