// The shadow bench on a small headlight: its rows say what they must, and the kinds of visibility
// come in the order that they are made for.
#include "luxfield/bench/bench_shadows.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

BenchShadowsOptions Small() {
  BenchShadowsOptions options;
  options.lamp.size = 64;
  options.width = 64;
  options.height = 48;
  options.reference_samples = 512;
  options.samples_per_pixel = {16, 128};
  options.map_sizes = {192};
  return options;
}

const nlohmann::json* Find(const nlohmann::json& rows, const std::string& variant, int samples) {
  for (const auto& row : rows)
    if (row["variant"] == variant && row["spp"] == samples) return &row;
  return nullptr;
}

TEST(BenchShadows, KindsOfVisibilityComeInTheirOrder) {
  auto options = Small();
  const auto folder = std::filesystem::path(testing::TempDir()) / "luxfield_bench_shadows";
  std::filesystem::remove_all(folder);
  options.pictures = folder.string();
  const auto rows = BenchShadows(options);
  for (const auto& row : rows)
    for (const char* key : {"variant", "maps", "map_size", "spp", "mean_lab", "rel_rmse", "bias",
                            "core_s", "build_core_s"})
      EXPECT_TRUE(row.contains(key)) << key;
  const auto lab = [&](const std::string& variant, int samples) {
    const auto* row = Find(rows, variant, samples);
    EXPECT_NE(row, nullptr) << variant;
    const double value = row ? row->at("mean_lab").get<double>() : 1e9;
    std::printf("%s, %d samples: mean Lab %.3f\n", variant.c_str(), samples, value);
    return value;
  };
  const double own = lab("reference", 512), open = lab("exact, no shadows", 0);
  EXPECT_LT(5 * own, open);
  // Eight times the samples: at least half of the error goes.
  EXPECT_LT(lab("windowed, traced", 128), 0.6 * lab("windowed, traced", 16));
  EXPECT_LT(lab("exact, traced", 128), 0.6 * lab("exact, traced", 16));
  EXPECT_LT(lab("exact, traced", 128), 0.7 * lab("windowed, traced", 128));
  const double maps = lab("exact, maps", 0), thesis = lab("exact, thesis-maps", 0);
  EXPECT_LT(maps, 1.2);  // the thesis' figure
  EXPECT_LT(maps, lab("windowed, maps", 128));
  EXPECT_LT(2 * maps, thesis);
  EXPECT_LT(thesis, open);
  const auto* row = Find(rows, "exact, maps", 0);
  EXPECT_EQ((*row)["maps"], 49);
  EXPECT_EQ((*row)["map_size"], 192);
  EXPECT_TRUE(std::filesystem::exists(folder / "reference.png"));
  EXPECT_TRUE(std::filesystem::exists(folder / "exact--maps-192-lab.png"));
  std::filesystem::remove_all(folder);
}

TEST(BenchShadows, RefusesWhatMakesNoSense) {
  auto options = Small();
  options.width = 0;
  EXPECT_THROW(BenchShadows(options), InputError);
  options = Small();
  options.estimators = {"guess"};
  EXPECT_THROW(BenchShadows(options), InputError);
  options = Small();
  options.samples_per_pixel = {0};
  EXPECT_THROW(BenchShadows(options), InputError);
  options = Small();
  options.map_sizes = {8};
  EXPECT_THROW(BenchShadows(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
