#include "luxfield/bench/bench_errors.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "luxfield/core/file.h"
#include "luxfield/core/progress.h"
#include "tests/e2e/tiny_session.h"

namespace luxfield::bench {
namespace {

const std::filesystem::path kData = std::filesystem::path(LUXFIELD_SOURCE_DIR) / "data";

class BenchErrorsTest : public testing::TestWithParam<const char*> {};

TEST_P(BenchErrorsTest, SigmaIsTheSpreadOverSeeds) {
  const std::string name = GetParam();
  BenchErrorsOptions options;
  options.lab = kData / "labs" / (name + ".toml");
  options.plan = kData / "plans" / (name + ".toml");
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_errors_" + name + std::to_string(::getpid()));
  options.seeds = 3;
  options.seed = 11;
  options.random_only = true;
  const nlohmann::json rows = BenchErrors(options);
  ASSERT_EQ(rows.size(), 1u);
  const nlohmann::json random = rows[0];
  EXPECT_EQ(random["case"], "random");
  SCOPED_TRACE(random.dump());
  // 2 x 20480 degrees of freedom, correlated within a session through its lamp factor.
  EXPECT_NEAR(random["sigma_ratio"].get<double>(), 1, 0.1);
  for (const char* quarter :
       {"sigma_ratio_q1", "sigma_ratio_q2", "sigma_ratio_q3", "sigma_ratio_q4"})
    EXPECT_NEAR(random[quarter].get<double>(), 1, 0.1);
  // These lamps have edges that no basis holds: the lamp itself is far from what was measured,
  // most of it by projection, to which noise adds in quadrature.
  const auto of = [&](const char* key) { return random[key].get<double>(); };
  EXPECT_GT(of("floor_rel_l2"), 2 * of("projection_rel_l2"));
  EXPECT_GT(of("rel_l2"), of("floor_rel_l2"));
  EXPECT_LT(of("rel_l2"), std::hypot(of("floor_rel_l2"), 3 * of("projection_rel_l2")));
  EXPECT_GT(of("rel_rmse"), of("floor_rel_rmse"));
  EXPECT_LT(of("rel_rmse"), std::hypot(of("floor_rel_rmse"), 3 * of("projection_rel_rmse")));
  // Duals of `quadratic` at a = 1/2 lose 12 % of the flux of an even lamp at any spacing (theory,
  // section 13), and those of a lamp that fills the grid more.
  EXPECT_LT(std::abs(of("flux_error")), name == "small-dual" ? 0.25 : 0.1);
  std::filesystem::remove_all(options.folder);
}

// Of a small lamp most texels are dark: their codes hardly move, and sigma is more than their spread.
TEST(BenchErrors, QuartersGoFromDarkToBright) {
  BenchErrorsOptions options;
  options.folder = std::filesystem::path(testing::TempDir()) /
                   ("luxfield_bench_quarters_" + std::to_string(::getpid()));
  std::filesystem::create_directories(options.folder);
  options.lab = options.folder / "tiny.toml";
  options.plan = options.folder / "plan.toml";
  core::WriteFileAtomically(options.lab, e2e::TinyLab(1, 0));
  core::WriteFileAtomically(options.plan, e2e::TinyPlan(7, 7));
  options.seeds = 4;
  options.random_only = true;
  const nlohmann::json random = BenchErrors(options)[0];
  std::filesystem::remove_all(options.folder);
  EXPECT_NEAR(random["sigma_ratio_q4"].get<double>(), 1, 0.2) << random;
  EXPECT_LT(random["sigma_ratio_q1"].get<double>(), 0.5) << random;
}

INSTANTIATE_TEST_SUITE_P(Rigs, BenchErrorsTest, testing::Values("small", "small-dual"));

}  // namespace
}  // namespace luxfield::bench
