#include "luxfield/bench/bench_budget.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"
#include "tests/core/chi_squared.h"
#include "tests/core/memory_folder.h"

namespace luxfield::bench {
namespace {

std::filesystem::path Scratch() {
  return MemoryFolder() / ("luxfield_bench_budget_" + std::to_string(getpid()));
}

struct Sample {
  const char* name;
  bool dual;
  std::vector<std::string> sources;
  std::size_t rows;
  int runs = 20, budgets = 3;
  double degrees = 20;  // of the mean square: the runs, where the errors are normal
};

// A sample of what `luxfield bench budget` runs 400 times. The mean square over n labs of a
// normal error is chi^2 of n degrees; its bounds are those of 1e-5 a side, 125 figures. Nothing is
// added for the prediction, whose own error (3 budgets, 6 % of the square) lies far inside.
//
// Not so for image shifts. Of a ray their slopes are mostly noise: a deviation is a product of
// normal numbers, its kurtosis is 3 to 4.6 over 150 runs, and the squares of single predictions
// scatter by 0.88 of their mean. Of 36 runs 2 36 / 3.6 = 20 degrees are left, 14 budgets have
// 2 14 / 0.88^2 = 36, their quotient has about 1 / (1 / 20 + 1 / 36) = 13.
class BenchBudgetTest : public testing::TestWithParam<Sample> {};

TEST_P(BenchBudgetTest, PredictionsHoldInSimulatedLabs) {
  BenchBudgetOptions options;
  options.folder = Scratch();
  options.runs = GetParam().runs;
  options.budgets = GetParam().budgets;
  options.seed = 20261122;
  options.dual = GetParam().dual;
  options.sources = GetParam().sources;
  std::printf("seed %llu\n", static_cast<unsigned long long>(options.seed));
  const nlohmann::json rows = BenchBudget(options);
  std::filesystem::remove_all(options.folder);
  const double low = ChiSquaredShare(GetParam().degrees, -kRareZ),
               high = ChiSquaredShare(GetParam().degrees, kRareZ);
  std::set<std::string> quantities;
  for (const auto& row : rows) {
    const double observed = row["observed"], predicted = row["predicted"];
    quantities.insert(row["quantity"].get<std::string>());
    EXPECT_GT(predicted, 0);
    const double share = observed * observed / (predicted * predicted);
    EXPECT_TRUE(share > low && share < high) << row.dump();
  }
  EXPECT_EQ(quantities.size(), 5u);
  EXPECT_EQ(rows.size(), GetParam().rows);
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, BenchBudgetTest,
    testing::Values(
        Sample{"Single",
               false,
               {"photon noise", "lamp drift", "monitor", "geometry", "print shift",
                "measured filter", "light meter", "total, scaled by the meter", "total"},
               50},
        Sample{"Dual",
               true,
               {"photon noise", "lamp drift", "monitor", "stage", "geometry", "density gamma",
                "grain", "measured filter", "light meter", "total, scaled by the meter", "total"},
               60},
        Sample{
            "SingleExposureTimes",
            false,
            {"exposure times", "exposure times, exposures estimated", "total, exposures estimated"},
            15},
        Sample{"SingleImageShift", false, {"image shift"}, 5, 36, 14, 13},
        Sample{"DualImageShift", true, {"image shift"}, 5, 36, 14, 13}),
    [](const auto& test) { return test.param.name; });

// Random lamps whose coefficients are independent, as many as scatter by 8 % at most.
TEST(BenchBudget, WhatMissingPositionsLeaveOpenIsForetold) {
  for (const bool dual : {false, true}) {
    BenchBudgetOptions options;
    options.runs = 60;
    options.seed = 20261124;
    options.dual = dual;
    options.sources = {"missing positions"};
    std::printf("seed %llu\n", static_cast<unsigned long long>(options.seed));
    const nlohmann::json rows = BenchBudget(options);
    EXPECT_EQ(rows.size(), 5u);
    for (const auto& row : rows)
      EXPECT_LT(std::abs(std::log(row["ratio"].get<double>())), std::log(1.4)) << row.dump();
  }
}

// A sample of the rows over random lamps. Their errors are far from normal: the root mean squares
// of 40 and of 8 scatter by 25 % and by half. Totals without the basis are a tenth of what is seen
// behind dual filters, and the loss of a basis of twice the spacing is 2.5 times that of this one.
TEST(BenchBudget, WhatTheBasisLosesOfRandomLampsIsForetold) {
  struct Ensemble {
    const char* source;
    int runs;
    std::size_t rows;
    double most;  // ratio, either way
  };
  for (const bool dual : {false, true})
    for (const auto& [source, runs, count, most] :
         {Ensemble{"basis", 40, 4, 1.5}, Ensemble{"basis, estimated", 40, 4, 3},
          Ensemble{"total, with the basis", 8, 5, 2.5}}) {
      BenchBudgetOptions options;
      options.folder = Scratch();
      options.runs = runs;
      options.seed = 20261123;
      options.dual = dual;
      options.sources = {source};
      std::printf("seed %llu\n", static_cast<unsigned long long>(options.seed));
      const nlohmann::json rows = BenchBudget(options);
      std::filesystem::remove_all(options.folder);
      EXPECT_EQ(rows.size(), count);
      for (const auto& row : rows)
        EXPECT_LT(std::abs(std::log(row["ratio"].get<double>())), std::log(most)) << row.dump();
    }
}

TEST(BenchBudget, RefusesSourcesThatItDoesNotKnow) {
  BenchBudgetOptions options;
  options.folder = Scratch();
  options.sources = {"photon noise", "moonlight"};
  EXPECT_THROW(BenchBudget(options), InputError);
  options.sources = {};
  options.runs = 1;
  EXPECT_THROW(BenchBudget(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
