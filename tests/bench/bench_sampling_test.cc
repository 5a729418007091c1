#include "luxfield/bench/bench_sampling.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

TEST(BenchSampling, RowsAreComplete) {
  BenchSamplingOptions options;
  options.car2.grid_width = 2;
  options.car2.grid_height = 2;
  options.car2.size = 16;
  options.width = 32;
  options.height = 24;
  options.repeats = 1;
  const auto rows = BenchSampling(options);
  ASSERT_EQ(rows.size(), 6u);
  for (const char* sampler : {"windowed", "cells", "uniform", "basis", "precomputed"})
    EXPECT_EQ(std::count_if(rows.begin(), rows.end(),
                            [&](const auto& row) { return row["sampler"] == sampler; }),
              1);
  for (const auto& row : rows) {
    EXPECT_EQ(row["scene"], "car2");
    EXPECT_TRUE(row["ns_per_sample"].is_number_float());
    EXPECT_TRUE(row["shaded_ns_per_sample"].is_number_float());
    EXPECT_TRUE(row["set_up_ns_per_pixel"].is_number_float());
    EXPECT_GE(row["threads"], 1);
  }
  options.many = options.few;
  EXPECT_THROW(BenchSampling(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
