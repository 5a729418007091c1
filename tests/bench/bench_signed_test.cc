#include "luxfield/bench/bench_signed.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

// Edges of facets ring: their negative coefficients light receivers as the lamp does, without them
// irradiance is off.
TEST(BenchSigned, SignedCoefficientsAreNearerToTheLamp) {
  BenchSignedOptions options;
  options.bases = {lightfield::BasisKind::kBspline2};
  options.grids = {9};
  options.lamps = {planning::ReferenceLampKind::kFaceted};
  options.receivers = 40;
  const auto rows = BenchSigned(options);
  ASSERT_EQ(rows.size(), 1u);
  const auto& row = rows[0];
  std::printf("%s\n", row.dump().c_str());
  EXPECT_EQ(row["basis"], "bspline2");
  EXPECT_EQ(row["lamp"], "faceted");
  EXPECT_GT(row["negative_share"], 0.05);
  EXPECT_LT(row["signed_error"], 0.8 * row["non_negative_error"].get<double>());
  EXPECT_GT(row["signed_noise"], 0);
  EXPECT_LT(row["signed_noise"], row["windowed_noise"]);
  EXPECT_LT(row["cells_t2"], 2);  // 15 / 13 expected, 40 receivers
  EXPECT_LT(row["windowed_t2"], 2);

  options.seeds = 3;
  EXPECT_THROW(BenchSigned(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
