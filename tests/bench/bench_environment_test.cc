#include "luxfield/bench/bench_environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"

namespace luxfield::bench {
namespace {

// A small run: densities integrate to 1, no z-value beyond 5, and balancing makes more of as many
// samples than sharing them out evenly.
TEST(BenchEnvironment, BalancingIsWorthIt) {
  BenchEnvironmentOptions options;
  options.face_size = 32;
  options.copies = 1024;
  options.error_width = 32;
  options.error_height = 24;
  options.reference_samples = 2048;
  options.seeds = 4;
  options.repeats = 0;
  const auto result = BenchEnvironment(options);
  ASSERT_GE(result["maps"].size(), 6u);
  for (const auto& row : result["maps"]) {
    EXPECT_LT(row.value("pdf_error", 0.0), 1e-5) << row;
    for (const std::string kind : {"", "edge_"}) {
      EXPECT_LT(row[kind + "z_worst"].get<double>(), 5) << row;
      // 24 squares of normal numbers: 1 +- 0.29.
      EXPECT_LT(row[kind + "z_mean_square"].get<double>(), 2.5) << row;
    }
  }
  const auto& all = result["maps"].back();
  std::printf("chi-squared %.1f of %d z-values, %+.2f standard deviations\n",
              all["chi_squared"].get<double>(), all["z_values"].get<int>(),
              all["sigmas"].get<double>());
  EXPECT_LT(std::abs(all["sigmas"].get<double>()), 4);
  std::map<std::string, double> error, useful;
  for (const auto& row : result["balance"]) {
    if (row["surface"] != "lambert" || row["sets"] != "scrambled" || row["tiles"] != 1 ||
        row["compensation"] != 0)
      continue;
    const std::string name =
        row["balance"].get<std::string>() + " " + std::to_string(row["spp"].get<int>());
    error[name] = row["rel_rmse"];
    useful[name] = row["useful"];
    std::printf("%s: error %.4f, useful %.3f\n", name.c_str(), error[name], useful[name]);
  }
  EXPECT_LT(error.at("cosine 60"), 0.8 * error.at("uniform 60"));
  EXPECT_GT(useful.at("cosine 60"), useful.at("uniform 60") + 0.1);
  EXPECT_LT(error.at("uniform 180"), error.at("uniform 60"));
  ASSERT_EQ(result["thesis"].size(), 4u);  // two surfaces, two kinds of sets
  for (const auto& row : result["thesis"]) {
    if (row["surface"] != "lambert" || row["sets"] != "scrambled") continue;
    EXPECT_NEAR(row["error_ratio"].get<double>(), error.at("cosine 60") / error.at("uniform 180"),
                1e-12);
  }
}

TEST(BenchEnvironment, ASequenceIsRenderedToItsEnd) {
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("bench_sky_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  for (const char* name : {"a.exr", "b.exr", "c.exr"}) {
    core::Image even(32, 16, 3);
    std::fill(even.data.begin(), even.data.end(), 2.0f);
    core::WriteExrImage(folder / name, even);
  }
  BenchEnvironmentOptions options;
  options.parts = {"tables"};
  options.repeats = 0;
  options.face_size = 16;
  options.width = 32;
  options.height = 24;
  options.samples_per_pixel = {8};
  options.sequence = folder;
  const auto result = BenchEnvironment(options);
  EXPECT_TRUE(result["maps"].empty());
  EXPECT_TRUE(result["tables"].empty());
  ASSERT_EQ(result["sequence"].size(), 2u);  // without and with shadows
  for (const auto& row : result["sequence"]) {
    EXPECT_EQ(row["frames"], 3);
    EXPECT_GT(row["fps"].get<double>(), 0);
  }
  std::filesystem::remove_all(folder);
}

TEST(BenchEnvironment, WrongOptionsAreNamed) {
  BenchEnvironmentOptions options;
  options.face_size = 30;
  EXPECT_THAT([&] { BenchEnvironment(options); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("multiple of 4")));
}

}  // namespace
}  // namespace luxfield::bench
