#include "luxfield/bench/bench_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::bench {
namespace {

// What pictures state is what they scatter by, over kinds of light, of samples and of estimators.
TEST(BenchNoise, PicturesStateTheirScatter) {
  BenchNoiseOptions options;
  options.seeds = 20;
  options.width = 24;
  options.height = 18;
  options.samples_per_pixel = 32;
  options.cases = {"lamp, cells",
                   "lamp, exact",
                   "lamp, windowed, dealt out",
                   "lamp, sky",
                   "sky, environment-sets=scrambled",
                   "area lights, strategies=newton"};
  const nlohmann::json rows = BenchNoise(options);
  ASSERT_GE(rows.size(), 14u);
  double least_stated = 10, most_stated = 0;
  for (const auto& row : rows) {
    const double ratio = row["ratio"], se = row["ratio_se"], stated = row["as_independent"];
    std::printf("%s: %.3f +- %.3f of the scatter, as independent %.2f, seeds 1 to 20\n",
                row["case"].get<std::string>().c_str(), ratio, se, stated);
    EXPECT_GT(ratio, 0);
    EXPECT_LT(std::abs(ratio - 1), 4 * se + 0.02) << row["case"];
    EXPECT_LT(se, 0.15) << row["case"];
    least_stated = std::min(least_stated, stated);
    most_stated = std::max(most_stated, stated);
    // A single estimate: as far off as it says, to a factor that 20 of them can tell.
    EXPECT_LT(row["scatter"].get<double>(), 2.5 * row["sigma"].get<double>() + 0.02) << row["case"];
  }
  EXPECT_GT(most_stated, 2);  // or there is nothing to correct
}

TEST(BenchNoise, RefusesASingleSeed) {
  BenchNoiseOptions options;
  options.seeds = 1;
  EXPECT_THROW(BenchNoise(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
