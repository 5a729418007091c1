#include "luxfield/bench/bench_rigs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

TEST(BenchRigs, AgreesWithTheSpectrumOfTheGramMatrix) {
  // On a wide grid white noise grows by sqrt(mean of 1 / symbol^2) an axis: the solve of a spline
  // of unit h, by quadrature over its symbol 11/20 + 2 (13/60 cos t + 1/120 cos 2t).
  double sum = 0;
  constexpr int kSteps = 4096;
  for (int n = 0; n < kSteps; ++n) {
    const double t = 2 * M_PI * (n + 0.5) / kSteps;
    const double symbol = 11.0 / 20 + 2 * (13.0 / 60 * std::cos(t) + std::cos(2 * t) / 120);
    sum += 1 / (symbol * symbol) / kSteps;
  }
  BenchRigsOptions options;
  options.grid_width = options.grid_height = 40;
  options.size = 8;
  const nlohmann::json rows = BenchRigs(options);
  ASSERT_EQ(rows.size(), 4u);
  // Borders, a tenth of the grid, amplify less.
  const double single = rows[1]["sigma_c"];
  EXPECT_NEAR(single / (sum * 9 / 16 / std::sqrt(2.0)), 0.95, 0.05);
  EXPECT_NEAR(rows[0]["sigma_c"].get<double>(), std::hypot(9, 0.919), 1e-3);
}

TEST(BenchRigs, SigmaIsTheSpread) {
  BenchRigsOptions options;
  options.size = 32;
  options.seed = 4;
  for (const auto& row : BenchRigs(options)) {
    SCOPED_TRACE(row.dump());
    // 101376 draws, of which the solve correlates some; a deviation scatters by 0.22 % or a little
    // more.
    EXPECT_NEAR(row["spread_c"].get<double>() / row["sigma_c"].get<double>(), 1, 0.02);
  }
}

TEST(BenchRigs, RefusesNothing) {
  BenchRigsOptions options;
  options.grid_height = 2;
  EXPECT_THROW(BenchRigs(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
