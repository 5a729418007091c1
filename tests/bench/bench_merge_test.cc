#include "luxfield/bench/bench_merge.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::bench {
namespace {

TEST(BenchMerge, MergesItsSessionFourWays) {
  BenchMergeOptions options;
  options.grid_width = 2;
  options.grid_height = 9;
  options.exposures = 3;
  options.sensor = 100;
  options.lattice = 20;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_merge_" + std::to_string(::getpid()));
  for (const bool reflector : {false, true}) {
    options.reflector = reflector;
    const nlohmann::json rows = BenchMerge(options);
    ASSERT_EQ(rows.size(), 4u);
    EXPECT_EQ(rows[0]["case"], "from disk");
    EXPECT_EQ(rows[0]["positions"], 18);
    EXPECT_EQ(rows[3]["positions"], 4);
    for (const auto& row : rows) {
      // Every position's frames, 4 darks of each exposure time, a reference per row of positions.
      const int positions = row["positions"], frames = positions * 3 + 12 + positions / 2;
      EXPECT_NEAR(row["gb"].get<double>(), frames * 2e-5, 1e-12);
      EXPECT_NEAR(row["mpix_per_s"].get<double>() * row["wall_s"].get<double>(), frames * 0.01,
                  1e-9);
      EXPECT_GT(row["copy_ratio"].get<double>(), 1);
      EXPECT_GT(row["peak_mib"].get<double>(), 0);
    }
    EXPECT_TRUE(std::filesystem::is_empty(options.folder));
  }
}

TEST(BenchMerge, StartsWithTheSessionThatAnEarlierRunKept) {
  BenchMergeOptions options;
  options.grid_width = options.grid_height = 2;
  options.exposures = 2;
  options.sensor = 64;
  options.lattice = 10;
  options.keep = true;
  options.cases = {"cached, hashes"};
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_merge_kept_" + std::to_string(::getpid()));
  const auto manifest = options.folder / "session" / "manifest.json";
  const nlohmann::json rows = BenchMerge(options);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0]["case"], "cached, hashes not checked");
  EXPECT_FALSE(std::filesystem::exists(options.folder / "few"));
  const auto written = std::filesystem::last_write_time(manifest);
  BenchMerge(options);
  EXPECT_EQ(std::filesystem::last_write_time(manifest), written);
  // A session of other options is written anew.
  options.sensor = 80;
  EXPECT_NEAR(BenchMerge(options)[0]["mpix"].get<double>(), 0.0064, 1e-12);
  EXPECT_NE(std::filesystem::last_write_time(manifest), written);
  options.cases = {"uncached"};
  EXPECT_THROW(BenchMerge(options), InputError);
  std::filesystem::remove_all(options.folder);
}

TEST(BenchMerge, RefusesNothing) {
  BenchMergeOptions options;
  options.exposures = 0;
  EXPECT_THROW(BenchMerge(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
