#include "luxfield/bench/bench_accuracy.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"

namespace luxfield::bench {
namespace {

using nlohmann::json;

json Row(bool resolved, bool kept, json time_ratio) {
  return {{"resolved", resolved}, {"kept", kept}, {"time_ratio", std::move(time_ratio)}};
}

TEST(AccuracySummary, CountsWhatTheReferenceCanTell) {
  const json summary = AccuracySummary({Row(true, true, 1.5), Row(true, false, 3.0),
                                        Row(false, true, 1.0), Row(false, false, nullptr)});
  EXPECT_EQ(summary["resolved"], 2);
  EXPECT_EQ(summary["kept"], 1);
  EXPECT_EQ(summary["unresolved"], 2);
  EXPECT_EQ(summary["timed"], 3);
  EXPECT_EQ(summary["within_twice_the_time"], 2);
  EXPECT_EQ(summary["median_time_ratio"], 1.5);
  EXPECT_EQ(summary["worst_time_ratio"], 3.0);
  EXPECT_EQ(AccuracySummary(json::array())["median_time_ratio"], 0);
}

TEST(BenchAccuracy, RefusesWhatMakesNoSense) {
  EXPECT_THROW(BenchAccuracy({}), InputError);
  BenchAccuracyOptions options;
  options.scenes = {"/nowhere/scene.toml"};
  options.targets.clear();
  EXPECT_THROW(BenchAccuracy(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
