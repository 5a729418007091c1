#include "study/bench_environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "core/error.h"

namespace luxfield::study {
namespace {

// A small run: densities integrate to 1, no z-value beyond 5, and balancing makes more of as many
// samples than sharing them out evenly.
TEST(BenchEnvironment, BalancingIsWorthIt) {
  BenchEnvironmentOptions options;
  options.face_size = 32;
  options.error_width = 32;
  options.error_height = 24;
  options.reference_samples = 2048;
  options.seeds = 4;
  options.repeats = 0;
  const auto result = BenchEnvironment(options);
  ASSERT_GE(result["maps"].size(), 6u);
  for (const auto& row : result["maps"]) {
    EXPECT_LT(row["pdf_error"].get<double>(), 1e-5) << row;
    EXPECT_LT(row["z_worst"].get<double>(), 5) << row;
    // 24 squares of normal numbers: 1 +- 0.29.
    EXPECT_LT(row["z_mean_square"].get<double>(), 2.5) << row;
  }
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
}

TEST(BenchEnvironment, WrongOptionsAreNamed) {
  BenchEnvironmentOptions options;
  options.face_size = 30;
  EXPECT_THAT([&] { BenchEnvironment(options); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("multiple of 4")));
}

}  // namespace
}  // namespace luxfield::study
