// The trade-off bench on a tiny scene: its rows hold what they must, its references are right.
#include "luxfield/bench/bench_tradeoff.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "luxfield/bench/bench_nearfield.h"
#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "luxfield/render/estimators/estimator.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

class BenchTradeoffTest : public testing::Test {
 protected:
  // A lamp before a wall with a box, and a floor.
  void SetUp() override {
    const auto folder = std::filesystem::path(testing::TempDir());
    lightfield::WriteLightField(
        folder / "tradeoff.lf.exr",
        render::SyntheticCar2({.grid_width = 3, .grid_height = 2, .size = 32, .channels = 1}));
    const auto scene = folder / "tradeoff.toml";
    std::ofstream(scene) << R"(
[camera]
position = [-1, -1, 1.5]
look_at = [0, 2.5, 0.3]
[[material]]
name = "grey"
albedo = [0.5, 0.4, 0.3]
[[material]]
name = "sheen"
kind = "phong"
albedo = [0.4, 0.4, 0.4]
specular = [0.3, 0.3, 0.3]
exponent = 8
[[quad]]
corner = [-3, -1, 0]
edge_u = [6, 0, 0]
edge_v = [0, 5, 0]
material = "grey"
[[box]]
size = [0.4, 0.4, 0.8]
position = [0.2, 2, 0.4]
material = "sheen"
[[luminaire]]
file = "tradeoff.lf.exr"
position = [0, 0, 0.6]
look_at = [0, 5, 0.5]
)";
    options_.scenes = {scene};
    options_.samples_per_pixel = {16, 256};
    options_.width = 24;
    options_.height = 18;
    options_.reference_samples = 2048;
  }

  BenchTradeoffOptions options_;
};

TEST_F(BenchTradeoffTest, RowsHoldEveryEstimatorAndTheirErrorsFall) {
  const json rows = BenchTradeoff(options_);
  std::set<std::string> seen;
  for (const auto& row : rows) {
    for (const char* key : {"scene",
                            "shadows",
                            "surface",
                            "estimator",
                            "spp",
                            "knobs",
                            "width",
                            "height",
                            "images",
                            "channels",
                            "threads",
                            "build_core_s",
                            "fps",
                            "core_s",
                            "rel_rmse",
                            "rel_mse",
                            "mean_lab",
                            "bias",
                            "reference_rel_rmse",
                            "resolved",
                            "pareto"})
      EXPECT_TRUE(row.contains(key)) << key;
    EXPECT_GT(row["core_s"].get<double>(), 0);
    EXPECT_TRUE(std::isfinite(row["rel_rmse"].get<double>()));
    seen.insert(row["estimator"]);
  }
  for (const auto& traits : render::EstimatorList()) EXPECT_TRUE(seen.contains(traits.name));

  const auto find = [&](const char* estimator, const char* shadows, int spp,
                        const char* surface = "diffuse") {
    for (const auto& row : rows)
      if (row["estimator"] == estimator && row["shadows"] == shadows && row["spp"] == spp &&
          row["knobs"] == "" && row["surface"] == surface)
        return row;
    ADD_FAILURE() << "no row of " << estimator << ", " << shadows << ", " << spp;
    return json::object();
  };
  // Float32 against the closed form in double.
  const json exact = find("exact", "off", 0);
  EXPECT_LT(exact.value("rel_rmse", 1.0), 1e-5);
  EXPECT_EQ(exact.value("reference_rel_rmse", 1.0), 0);
  EXPECT_EQ(exact.value("resolved", false), true);
  // Sixteen times the samples make about a quarter of the error, also against sampled references,
  // whose own noise must not show.
  for (const char* surface : {"diffuse", "glossy"})
    for (const char* shadows : {"off", "on"}) {
      const double coarse = find("windowed", shadows, 16, surface).value("rel_rmse", 0.0),
                   fine = find("windowed", shadows, 256, surface).value("rel_rmse", 1.0);
      EXPECT_LT(fine, 0.5 * coarse) << shadows << " " << surface;
      EXPECT_GT(fine, 0) << shadows << " " << surface;
    }
  for (const auto& traits : render::EstimatorList())
    for (const auto& row : rows)
      EXPECT_TRUE(traits.any_brdf || row["estimator"] != traits.name || row["surface"] == "diffuse")
          << traits.name;
  const json traced = find("windowed", "on", 16);
  EXPECT_GT(traced.value("reference_rel_rmse", 0.0), 0);
  EXPECT_LT(traced.value("reference_rel_rmse", 1.0), 0.5 * traced.value("rel_rmse", 0.0));
  for (const auto& row : rows)
    EXPECT_GE(row["rel_rmse"].get<double>(), row["reference_rel_rmse"].get<double>());
}

TEST_F(BenchTradeoffTest, RefusesWhatMakesNoSense) {
  auto options = options_;
  options.estimators = {"guess"};
  EXPECT_THROW(BenchTradeoff(options), InputError);
  options = options_;
  options.width = 0;
  EXPECT_THROW(BenchTradeoff(options), InputError);
  options = options_;
  options.scenes = {"/nowhere/scene.toml"};
  EXPECT_THROW(BenchTradeoff(options), InputError);
  std::filesystem::remove(options_.scenes[0].parent_path() / "tradeoff.lf.exr");
  EXPECT_THROW(BenchTradeoff(options_), InputError);
}

TEST(Pareto, FrontOfEachGroup) {
  const auto row = [](const char* scene, double time, double error) {
    return json{{"scene", scene},
                {"shadows", "none"},
                {"surface", "diffuse"},
                {"core_s", time},
                {"rel_rmse", error}};
  };
  json rows = {row("a", 1, 0.5), row("a", 2, 0.1), row("a", 2, 0.2),
               row("a", 3, 0.1), row("b", 9, 0.9), row("a", 1, 0.5)};
  MarkPareto(rows);
  std::vector<bool> front;
  for (const auto& r : rows) front.push_back(r["pareto"]);
  EXPECT_EQ(front, (std::vector<bool>{true, true, false, false, true, true}));
}

}  // namespace
}  // namespace luxfield::bench
