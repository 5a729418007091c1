// The near-field bench on a small headlight: its rows say what they must, and its judge agrees with
// `exact`.
#include "luxfield/bench/bench_nearfield.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include <stdexcept>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/estimator.h"

namespace luxfield::bench {
namespace {

BenchNearfieldOptions Small() {
  BenchNearfieldOptions options;
  options.car2 = {.grid_width = 4, .grid_height = 3, .size = 64, .channels = 3};
  options.width = 64;
  options.height = 48;
  options.samples_per_pixel = {16, 256};
  options.repeats = 1;
  options.reference_pixels = 0;
  return options;
}

TEST(BenchNearfield, RowsHaveEveryKeyAndExactIsExact) {
  const auto rows = BenchNearfield(Small());
  for (const auto& row : rows) {
    for (const char* key :
         {"scene", "estimator", "spp", "width", "height", "images", "channels", "threads",
          "build_core_s", "fps", "core_s", "rel_rmse", "mean_lab", "bias"})
      EXPECT_TRUE(row.contains(key)) << key;
    EXPECT_GT(row["fps"].get<double>(), 0);
    EXPECT_EQ(row["images"], 12);
    EXPECT_EQ(row["channels"], 3);
  }
  const auto row = [&](const std::string& estimator, int spp) {
    for (const auto& candidate : rows)
      if (candidate["estimator"] == estimator && candidate["spp"] == spp) return candidate;
    throw std::out_of_range(estimator);
  };
  const auto exact = row("exact", 0), volume = row("volume", 0);
  EXPECT_LT(exact["rel_rmse"].get<double>(), 1e-5);
  EXPECT_LT(exact["mean_lab"].get<double>(), 1e-2);
  EXPECT_GT(volume["build_core_s"].get<double>(), 0);
  EXPECT_LT(volume["rel_rmse"].get<double>(), 2.5e-3);  // built for 2e-3
  // Sixteen times the samples: at least half the error (a quarter or less is expected).
  const auto few = row("windowed", 16), many = row("windowed", 256);
  EXPECT_LT(many["rel_rmse"].get<double>(), 0.5 * few["rel_rmse"].get<double>());
  EXPECT_LT(std::abs(many["bias"].get<double>()), 0.02);
  // Samples a frame, of both rates: spp of each pixel that is hit.
  const auto samples = [](const auto& of) {
    return of["samples_per_s"].template get<double>() / of["fps"].template get<double>();
  };
  EXPECT_GT(samples(few), 0);
  EXPECT_NEAR(samples(many) / samples(few), 16, 1e-9);
  EXPECT_NO_THROW(row("thesis", 256));
}

TEST(BenchNearfield, RefusesWhatMakesNoSense) {
  auto options = Small();
  options.estimators = {"guess"};
  EXPECT_THROW(BenchNearfield(options), InputError);
  options = Small();
  options.width = 0;
  EXPECT_THROW(BenchNearfield(options), InputError);
  options = Small();
  options.car2.channels = 2;
  EXPECT_THROW(BenchNearfield(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
