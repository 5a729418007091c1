#include "luxfield/bench/bench_stacks.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "tests/reconstruct/frobisher.h"

namespace luxfield::bench {
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

// One channel of three JPEGs of a Canon 5D Mark II; the curve that was published with them, g in
// natural logarithms. `bench stacks --frobisher` shows all three (docs/performance.md).
TEST(BenchStacks, CurvesAndMergesOfTheFrobisherStackAgreeWithThePublishedCurve) {
  LUXFIELD_NEEDS_DATA(reconstruct::FrobisherFile(""));
  BenchStacksOptions options;
  options.width = 0;
  options.frobisher = reconstruct::FrobisherFile("");
  options.channels = "G";
  options.folder = std::filesystem::path(testing::TempDir()) / "luxfield_bench_stacks_frobisher";
  const nlohmann::json result = BenchStacks(options);
  std::filesystem::remove_all(options.folder);
  std::map<std::string, nlohmann::json> curves, merges;
  for (const auto& row : result["curves"]) {
    EXPECT_EQ(row["channel"], "G");
    curves[row["fit"].get<std::string>()] = row;
    std::printf("%s\n", row.dump().c_str());
  }
  for (const auto& row : result["merges"]) {
    EXPECT_EQ(row["stack"], "Frobisher G");
    merges[row["merger"].get<std::string>()] = row;
    std::printf("%s\n", row.dump().c_str());
  }
  // The same problem with other samples, and our own ones: a fiftieth of a stop is 0.014.
  EXPECT_LT(curves.at("ours debevec-1997")["rms"], 0.01);
  const double theirs = curves.at("OpenCV Debevec")["rms"];
  for (const char* fit : {"ours debevec", "ours robertson", "ours polynomial"}) {
    const auto& curve = curves.at(fit);
    EXPECT_LE(curve["from"], 10) << fit;
    EXPECT_GE(curve["to"], 230) << fit;
    EXPECT_LT(curve["rms"], 0.03) << fit;
    EXPECT_LT(curve["steps"], 0.03) << fit;
    EXPECT_LT(curve["rms"], theirs) << fit;
    const auto& merge = merges.at(fit);
    EXPECT_LT(merge["rms"], 4) << fit;
    EXPECT_LT(merge["rms"], merges.at("OpenCV Debevec")["rms"]) << fit;
    EXPECT_GT(merge["seen"], 97) << fit;
    EXPECT_EQ(merge["invented"], 0) << fit;
  }
  // Its sigma holds what the smooth curve differs by.
  EXPECT_LT(curves.at("ours debevec")["in_sigma"], 2);
}

TEST(BenchStacks, RefusesChannelsThatThereAreNot) {
  BenchStacksOptions options;
  options.folder = std::filesystem::path(testing::TempDir()) / "luxfield_bench_stacks_refused";
  options.channels = "GX";
  EXPECT_THROW(BenchStacks(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
