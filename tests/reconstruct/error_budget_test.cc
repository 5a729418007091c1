#include "luxfield/reconstruct/bracket/merge_shares.h"
#include "luxfield/reconstruct/budget/budget_settings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {
namespace {

rig::SensorModel Sensor() {
  rig::SensorModel sensor;
  sensor.width = 5;
  sensor.height = 1;
  sensor.gain_dn_per_e = 0.5;
  sensor.read_noise_dn = 3;
  sensor.black_dn = 100;
  sensor.saturation_dn = 10000;
  sensor.prnu = 0.01;
  return sensor;
}

session::RawFrame Frame(const rig::SensorModel& sensor, const std::vector<double>& rates,
                        double t) {
  session::RawFrame frame;
  frame.width = 5;
  frame.height = 1;
  for (const double rate : rates)
    frame.dn.push_back(static_cast<std::uint16_t>(std::min(
        std::round(sensor.black_dn + sensor.gain_dn_per_e * t * rate), sensor.saturation_dn)));
  return frame;
}

// A dim pixel takes all three exposures, brighter ones and their neighbours (blooming) fewer: X and
// its variance are sums over the shares.
TEST(MergeShares, AreTheMergesOwn) {
  const rig::SensorModel sensor = Sensor();
  const std::vector<double> times = {0.1, 0.4, 1.6}, rates = {3000, 3000, 14000, 14000, 150000};
  std::vector<session::RawFrame> frames;
  for (const double t : times) frames.push_back(Frame(sensor, rates, t));
  for (const Estimator estimator : {Estimator::kInverseVariance, Estimator::kPoisson}) {
    MergeOptions options;
    options.estimator = estimator;
    std::vector<Exposure> exposures;
    for (std::size_t n = 0; n < times.size(); ++n) exposures.push_back({&frames[n], times[n]});
    const MergedFrame merged = MergeExposures(sensor, exposures, options);
    const MergeShares merge(sensor, exposures, options, merged);
    const std::vector<std::size_t> taken = {3, 2, 2, 1, 1};
    for (std::size_t p = 0; p < taken.size(); ++p) {
      ASSERT_EQ(merged.mask[p], 0u);
      std::vector<SampleShare> shares;
      merge.At(p, &shares);
      double x = 0, sum = 0, variance = std::pow(sensor.prnu * merged.rate_e_per_s[p], 2);
      std::size_t count = 0;
      for (std::size_t n = 0; n < 3; ++n) {
        x += shares[n].share * (frames[n].at(p) - sensor.black_dn) / shares[n].k;
        sum += shares[n].share;
        variance += shares[n].share * shares[n].share *
                    (shares[n].photon_variance + shares[n].own_variance);
        count += shares[n].share > 0;
      }
      EXPECT_EQ(count, taken[p]);
      EXPECT_NEAR(sum, 1, 1e-12);
      EXPECT_NEAR(x, merged.rate_e_per_s[p], 1e-6 * x);  // float32
      EXPECT_NEAR(std::sqrt(variance), merged.sigma_e_per_s[p], 1e-6 * merged.sigma_e_per_s[p]);
    }
  }
}

TEST(BudgetSettings, WhatIsAbsentIsNotStated) {
  const auto settings = ReadBudgetSettings(core::Config::FromString(
      "[uncertainty]\nstage_m = 5e-6\ndensity = 0\nsmallest_spot_m = 2e-3\n"
      "[[irradiance]]\np_m = [0, 0, 3]\nnormal = [0, -1, -1]\n"
      "[meter]\nserial_number = \"T-10A 1234\"\ncalibration_date = \"2026-03-02\"\n"
      "v_lambda = \"f1' 3 %\"\n"
      "[[meter.reading]]\np_m = [0, 0, 2]\nvalue = 3\nsigma = 0.1\n",
      "budget.toml"));
  EXPECT_EQ(settings.sizes.stage_m, 5e-6);
  EXPECT_EQ(settings.sizes.density, 0);
  EXPECT_EQ(settings.sizes.smallest_spot_m, 2e-3);
  EXPECT_FALSE(settings.sizes.shutter_jitter_s);
  ASSERT_EQ(settings.receivers.size(), 1u);
  EXPECT_NEAR(settings.receivers[0].normal.z, -std::sqrt(0.5), 1e-15);
  ASSERT_TRUE(settings.meter);
  EXPECT_EQ(settings.meter->readings.size(), 1u);
  EXPECT_EQ(settings.meter->serial_number, "T-10A 1234");
  EXPECT_EQ(settings.meter->calibration_date, "2026-03-02");
  EXPECT_EQ(settings.meter->v_lambda, "f1' 3 %");
}

TEST(BudgetSettings, RefusesWhatMakesNoSense) {
  for (const char* text :
       {"[uncertainty]\nstage = 1\n", "[uncertainty]\ndensity = -0.1\n",
        "[uncertainty]\nsmallest_spot_m = 0\n", "[uncertainty]\nlamp_wander = 0.1\n",
        "[uncertainty]\ngrain = 0.1\n", "[[irradiance]]\np_m = [0, 0, -1]\n",
        "[[irradiance]]\np_m = [0, 0, 1]\nnormal = [0, 0, 0]\n", "[meter]\ncalibration = 0.01\n",
        "[meter]\n[[meter.reading]]\np_m = [0, 0, 2]\nvalue = 3\nsigma = 0\n"})
    EXPECT_THROW(ReadBudgetSettings(core::Config::FromString(text, "budget.toml")), InputError)
        << text;
}

}  // namespace
}  // namespace luxfield::reconstruct
