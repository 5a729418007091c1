#include "study/bench_stacks.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

namespace luxfield::study {
namespace {

TEST(BenchStacks, OursKnowsItsErrorAndInventsNothing) {
  BenchStacksOptions options;
  options.width = 256;
  options.height = 96;
  options.folder = std::filesystem::path(testing::TempDir()) / "luxfield_bench_stacks";
  const nlohmann::json result = BenchStacks(options);
  std::filesystem::remove_all(options.folder);
  std::map<std::string, nlohmann::json> rows;
  for (const auto& row : result["merges"])
    rows[row["stack"].get<std::string>() + ", " + row["merger"].get<std::string>()] = row;
  for (const char* stack : {"8 bit", "16 bit"}) {
    const auto& ours = rows.at(std::string(stack) + ", ours debevec");
    EXPECT_GT(ours["seen"], 90);
    EXPECT_EQ(ours["invented"], 0);
    // The curve's error is common to all pixels: a handful of independent ones.
    EXPECT_NEAR(ours["sigma"].get<double>(), 1, 0.3);
  }
  EXPECT_LT(rows.at("8 bit, ours debevec")["rms"], rows.at("8 bit, OpenCV Debevec")["rms"]);
  EXPECT_GT(rows.at("8 bit, OpenCV Debevec")["invented"], 0);
  EXPECT_TRUE(rows.at("16 bit, OpenCV Robertson").contains("refused"));
}

}  // namespace
}  // namespace luxfield::study
