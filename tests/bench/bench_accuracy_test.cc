#include "luxfield/bench/bench_accuracy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/render/accuracy/car2.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

json Row(bool resolved, bool kept, json time_ratio) {
  return {{"resolved", resolved}, {"kept", kept}, {"time_ratio", std::move(time_ratio)}};
}

TEST(AccuracySummary, CountsWhatTheReferenceCanTell) {
  const json summary = AccuracySummary({Row(true, true, 1.5), Row(true, false, 3.0),
                                        Row(false, true, 1.0), Row(false, false, nullptr)});
  EXPECT_EQ(summary["resolved"], 2);
  EXPECT_EQ(summary["kept"], 1);
  EXPECT_EQ(summary["unresolved"], 2);
  EXPECT_EQ(summary["timed"], 3);
  EXPECT_EQ(summary["within_twice_the_time"], 2);
  EXPECT_EQ(summary["median_time_ratio"], 1.5);
  EXPECT_EQ(summary["worst_time_ratio"], 3.0);
  EXPECT_EQ(AccuracySummary(json::array())["median_time_ratio"], 0);
}

TEST(BenchAccuracy, RefusesWhatMakesNoSense) {
  EXPECT_THROW(BenchAccuracy({}), InputError);
  BenchAccuracyOptions options;
  options.scenes = {"/nowhere/scene.toml"};
  options.targets.clear();
  EXPECT_THROW(BenchAccuracy(options), InputError);
}

// A lamp over a floor, by made-up times that pilots correct: nothing is measured before.
TEST(BenchAccuracy, ComparesWithTheSweepsSamples) {
  const std::filesystem::path folder = testing::TempDir();
  lightfield::WriteLightField(
      folder / "luxfield_accuracy.lf.exr",
      render::SyntheticCar2({.grid_width = 3, .grid_height = 2, .size = 32, .channels = 1}));
  const auto scene = folder / "luxfield_accuracy.toml";
  std::ofstream(scene) << R"(
[camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.3]
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 5, 0]
material = "grey"
[[luminaire]]
file = "luxfield_accuracy.lf.exr"
position = [0, 0, 0.6]
look_at = [0, 5, 0.5]
)";
  BenchAccuracyOptions options;
  options.scenes = {scene};
  options.width = 12;
  options.height = 9;
  options.seeds = 1;
  options.reference_samples = 1 << 12;
  options.targets = options.shadowed_targets = {1, 0.05};
  options.costs.emplace();
  options.costs->coefficients_s["exact"] = {0, 1e-6, 0, 0, 0, 0};
  options.costs->coefficients_s["windowed"] = {0, 0, 0, 0, 1e-7, 1e-7};
  const json rows = BenchAccuracy(options);
  ASSERT_EQ(rows.size(), 4u);
  for (const json& row : rows) {
    SCOPED_TRACE(row.dump());
    EXPECT_TRUE(row["estimator"] == "exact" || row["estimator"] == "windowed");
    EXPECT_TRUE(row["met"]);
    ASSERT_FALSE(row["time_ratio"].is_null());
    constexpr int kLeastOfSweep = 4;
    EXPECT_GE(row["best_fixed_spp"], kLeastOfSweep);
    if (row["best_fixed"] == "exact") {  // nothing shades the floor: samples leave no noise
      EXPECT_EQ(row["best_fixed_spp"], kLeastOfSweep);
    }
  }
}

}  // namespace
}  // namespace luxfield::bench
