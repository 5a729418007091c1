#include "luxfield/bench/bench_filters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/bench/bench_conditioning.h"
#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

// The claim at the size of a test: 1 % registration and 2 % density error, of one print and of both
// prints of a dual pair.
class BenchFiltersTest : public testing::TestWithParam<const char*> {};

TEST_P(BenchFiltersTest, MeasuredFiltersBringTheErrorBackToTheNoiseFloor) {
  BenchFiltersOptions options;
  const std::string data = LUXFIELD_SOURCE_DIR "/data", name = GetParam();
  options.lab = data + "/labs/" + name + ".toml";
  options.plan = data + "/plans/" + name + ".toml";
  options.folder = std::filesystem::path(testing::TempDir()) / ("luxfield_bench_filters_" + name);
  options.pixels = 256;
  const nlohmann::json rows = BenchFilters(options);
  std::filesystem::remove_all(options.folder);
  ASSERT_EQ(rows.size(), 3u);
  for (const auto& row : rows)
    printf("%-42s rel_l2 %.4f, %.3f of the floor\n", row["case"].get<std::string>().c_str(),
           row["rel_l2"].get<double>(), row["over_floor"].get<double>());
  const bool dual = name == "small-dual";
  // C of a dual pair has a fifth of the noise. The ideal filter costs 1.8 and 0.9 % of C beside it.
  EXPECT_GT(rows[1]["rel_l2"].get<double>(), dual ? 0.007 : 0.02);
  EXPECT_GT(rows[1]["over_floor"].get<double>(), dual ? 2.5 : 1.4);
  EXPECT_LT(rows[2]["over_floor"].get<double>(), 1.1);
  EXPECT_GE(rows[2]["condition"].get<double>(), 1);
  EXPECT_EQ(rows[0]["solve"], dual ? "none" : "gram");
  EXPECT_EQ(rows[2]["solve"], "general");
}

INSTANTIATE_TEST_SUITE_P(Rigs, BenchFiltersTest, testing::Values("small", "small-dual"),
                         [](const auto& test) {
                           return std::string(test.param) == "small" ? "Single" : "Dual";
                         });

TEST(BenchConditioning, ConditionNumbersAreThePredictedOnes) {
  BenchConditioningOptions options;
  options.counts = {1, 2, 7, 16};
  int in_one_place = 0, singular = 0, told = 0;
  for (const auto& row : BenchConditioning(options)) {
    const std::string answer = row["answer"], name = row["case"];
    if (answer != "solved") {
      in_one_place += answer.find("sit in one place") != std::string::npos;
      singular +=
          answer.find("cannot be told apart (condition number 7.15e+12") != std::string::npos;
      continue;
    }
    ++told;
    const double predicted = row["predicted"];
    // Midpoint sums are good to 1e-8 of an entry, that is 1e-8 times itself of a condition number;
    // positions 1e-6 off change theirs by about as much.
    const double tolerance = std::min(1e-7 * predicted, 1e-4) +
                             (name == "spacing 1e-6 too wide, assumed right" ? 1e-4 : 0);
    EXPECT_NEAR(row["condition"].get<double>() / predicted, 1, tolerance) << name;
    // Float-free: rounding and 1e-8 of quadrature, times the condition number.
    EXPECT_LT(row["c_error"].get<double>(),
              name == "spacing 1e-6 too wide, assumed right" ? 1e-3 : 1e-6 * predicted)
        << name;
  }
  EXPECT_EQ(in_one_place, 2);
  EXPECT_EQ(singular, 1);  // a border that clips 2.9 spacings
  EXPECT_EQ(told, 8 + 3 + 2 + 4);
  options.counts = {0};
  EXPECT_THROW(BenchConditioning(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
