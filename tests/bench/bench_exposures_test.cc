#include "luxfield/bench/bench_exposures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "luxfield/core/error.h"
#include "luxfield/core/progress.h"

namespace luxfield::bench {
namespace {

rig::SensorModel Sensor(double gain, double read_noise_dn) {
  rig::SensorModel sensor;
  sensor.bits = 14;
  sensor.gain_dn_per_e = gain;
  sensor.read_noise_dn = read_noise_dn;
  sensor.black_dn = 512;
  sensor.saturation_dn = 16383;
  return sensor;
}

TEST(FisherInformation, HasItsKnownLimits) {
  // Counting without noise: 1 / mean (0.07 DN of noise against 1 DN per electron).
  for (const double mean : {0.5, 3.0, 40.0, 2000.0})
    EXPECT_NEAR(FisherInformation(Sensor(1, 0.07), mean) * mean, 1, 1e-6) << mean;
  // Bright and well dithered: the variances of all three sources add up. A normal of this mean and
  // variance would hold 1 / (2 variance^2) more, which bounds what is neglected.
  for (const double mean : {300.0, 3e4}) {
    const double variance = mean + (3.34 * 3.34 + 1.0 / 12) / (0.42 * 0.42);
    EXPECT_NEAR(FisherInformation(Sensor(0.42, 3.34), mean) * variance, 1, 1 / variance) << mean;
  }
  // Every sample clips: nothing is known.
  EXPECT_LT(FisherInformation(Sensor(0.42, 3.34), 5e4) * 5e4, 1e-6);
}

TEST(BenchExposures, IsUnbiasedAndAsNoisyAsItMustBe) {
  BenchExposuresOptions options;
  options.pixels = 1 << 14;
  options.stops = 6;
  options.per_stop = 1;
  options.seed = 77;
  const nlohmann::json rows = BenchExposures(options);
  EXPECT_EQ(rows.size(), 3u * (7 + 2 + 4));
  // A sample deviation scatters by 1 / sqrt(2 n).
  const double scatter = 1 / std::sqrt(2.0 * options.pixels);
  for (const auto& row : rows) {
    SCOPED_TRACE(row.dump());
    if (row.contains("flagged")) {
      // A pixel of 8 electrons of noise shows 24 by chance one time in 740.
      EXPECT_GT(row["flagged"].get<double>(), 0.99);
      if (row["sensor"] == "14 bit" && row.contains("bias_kept")) {
        // 5 standard errors of the mean.
        EXPECT_LT(std::abs(row["bias_kept"].get<double>()), 5 / std::sqrt(options.pixels));
        EXPECT_GT(row["bias_dropped"].get<double>(), 3);  // what is left is above 3 sigma
      }
      if (row["case"] != "one photon, noisy") {
        EXPECT_EQ(row["flagged"], 1);
        EXPECT_EQ(row["no_number"], 1);
      }
      EXPECT_EQ(row["no_number"], row["flagged"]);
      continue;
    }
    ASSERT_EQ(row["used"], 1);
    EXPECT_LT(std::abs(row["bias"].get<double>()), 5 * row["bias_se"].get<double>());
    EXPECT_NEAR(row["sigma_ratio"].get<double>(), 1, 0.02 + 5 * scatter);
    EXPECT_NEAR(row["spread_ratio"].get<double>(), 1, 5 * scatter + 0.02);
  }
}

TEST(BenchExposures, RefusesNothing) {
  BenchExposuresOptions options;
  options.pixels = 0;
  EXPECT_THROW(BenchExposures(options), InputError);
}

}  // namespace
}  // namespace luxfield::bench
