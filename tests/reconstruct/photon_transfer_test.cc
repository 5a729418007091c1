#include "luxfield/reconstruct/calibrate/sensor/photon_transfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/reconstruct/calibrate/sensor/linearity.h"
#include "tests/reconstruct/test_sensor.h"

namespace luxfield::reconstruct {
namespace {

constexpr std::uint64_t kSeed = 1288;

// Exposure times that fill the sensor from `lowest` to `highest` of its range, geometrically.
std::vector<double> Ladder(const TestSensor& sensor, int levels, double lowest = 0.01,
                           double highest = 1.4) {
  std::vector<double> times;
  for (int k = 0; k < levels; ++k)
    times.push_back(sensor.full_e() / (sensor.light_e_per_s + sensor.dark_e_per_s) * lowest *
                    std::pow(highest / lowest, k / (levels - 1.0)));
  return times;
}

struct Capture {
  std::vector<PairStatistics> pairs;
  PatternVariance prnu_squared;  // at the brightest level below 0.8 of the range
};

// Flats and darks, a pair each for every time; `drift`: lamp level of each pair's second frame.
Capture Take(const TestSensor& sensor, const std::vector<double>& times, double drift = 1) {
  Capture capture;
  const PixelMask mask(static_cast<std::size_t>(sensor.width) * sensor.height, 1);
  std::uint64_t stream = 0;
  double brightest = 0;
  for (const double t : times) {
    session::RawFrame frames[4];
    for (int k = 0; k < 4; ++k)
      frames[k] = sensor.Expose(k >= 2 ? 0 : k == 1 ? drift : 1, t, ++stream);
    for (const bool dark : {false, true}) {
      PairStatistics pair = MeasurePair(frames[dark ? 2 : 0], frames[dark ? 3 : 1], mask);
      pair.dark = dark;
      pair.exposure_s = t;
      capture.pairs.push_back(pair);
      const double level = (pair.mean() - sensor.black_dn) / (sensor.full_dn() - sensor.black_dn);
      if (!dark && level < 0.8 && level > brightest) {
        brightest = level;
        capture.prnu_squared = MeasurePrnuSquared(frames[0], frames[1], frames[2], frames[3], mask);
      }
    }
  }
  return capture;
}

// Log-uniform over the ranges that the calibration is made for.
TestSensor RandomSensor(std::uint64_t index) {
  core::Random random(kSeed, index);
  const auto between = [&](double low, double high) {
    return low * std::pow(high / low, random.Uniform());
  };
  for (;;) {
    TestSensor sensor;
    sensor.seed = 1000 * kSeed + index;
    sensor.width = sensor.height = 40;
    sensor.bits = 8 + 2 * static_cast<int>(5 * random.Uniform());
    sensor.gain_e_per_dn = between(0.1, 10);
    sensor.read_noise_e = between(1, 30);
    sensor.prnu = 0.03 * random.Uniform();
    sensor.dark_e_per_s = 100 * random.Uniform();
    sensor.black_dn = std::ceil(8 * sensor.read_noise_e / sensor.gain_e_per_dn) + 2;
    sensor.light_e_per_s = sensor.full_e() / 0.7;
    // What a lab would not call a camera: noise that fills the range, a well of some electrons,
    // darks that fill it.
    const double noise_dn = sensor.read_noise_e / sensor.gain_e_per_dn;
    if (noise_dn >= 0.7 && sensor.full_dn() > 60 * noise_dn && sensor.full_e() > 400 &&
        sensor.dark_e_per_s < 0.2 * sensor.light_e_per_s)
      return sensor;
  }
}

TEST(PhotonTransfer, RecoversSensorsWithinItsStatedErrors) {
  constexpr int kSensors = 400;
  struct Figure {
    const char* name;
    double sum = 0, squares = 0;
    void Add(const Quantity& q, double truth) {
      const double z = (q.value - truth) / q.sigma;
      sum += z;
      squares += z * z;
    }
  };
  Figure gain{"gain"}, read{"read variance"}, dark{"dark current"}, offset{"offset"},
      prnu{"PRNU^2"};
  double fit = 0, fit_degrees = 0, bent = 0, bent_degrees = 0;
  for (int n = 0; n < kSensors; ++n) {
    const TestSensor sensor = RandomSensor(n);
    const Capture capture = Take(sensor, Ladder(sensor, 10));
    const PhotonTransfer result = FitPhotonTransfer(capture.pairs);
    gain.Add(result.gain_e_per_dn, sensor.gain_e_per_dn);
    read.Add(result.read_variance_e2, sensor.read_noise_e * sensor.read_noise_e);
    dark.Add(result.dark_current_e_per_s, sensor.dark_e_per_s);
    offset.Add(result.offset_dn, sensor.black_dn);
    prnu.Add({capture.prnu_squared.value, capture.prnu_squared.sigma}, sensor.prnu * sensor.prnu);
    fit += result.chi_squared;
    fit_degrees += result.degrees;
    ASSERT_TRUE(result.saturation_dn);
    EXPECT_EQ(result.saturation_dn->value, sensor.full_dn());
    const Linearity linearity = MeasureLinearity(capture.pairs, result, 0);
    bent += linearity.chi_squared;
    bent_degrees += linearity.degrees;
  }
  double pooled = 0;
  for (const Figure* f : {&gain, &read, &dark, &offset, &prnu}) {
    std::cout << f->name << ": mean z " << f->sum / kSensors << ", chi^2/dof "
              << f->squares / kSensors << "\n";
    pooled += f->squares;
    // Mean of z within 3.5 of its error: the bias is far below a standard error.
    EXPECT_LT(std::abs(f->sum), 3.5 * std::sqrt(kSensors)) << f->name;
  }
  std::cout << "pooled " << pooled / (5 * kSensors) << ", fits " << fit / fit_degrees
            << ", linearity " << bent / bent_degrees << " (seed " << kSeed << ", " << kSensors
            << " sensors)\n";
  // 2000 figures, some of them correlated: 1 +- 0.036.
  EXPECT_NEAR(pooled / (5 * kSensors), 1, 0.1);
  EXPECT_NEAR(fit / fit_degrees, 1, 4 * std::sqrt(2 / fit_degrees));
  EXPECT_NEAR(bent / bent_degrees, 1, 4 * std::sqrt(2 / bent_degrees));
}

TEST(PhotonTransfer, LeavesReadNoiseBelowTheRoundingUnresolved) {
  // 1.5 electrons are 0.15 DN: no variance of rounded numbers shows them, only the light's does.
  for (const double gain : {6.0, 8.0, 10.0}) {
    TestSensor sensor;
    sensor.seed = kSeed;
    sensor.bits = 12;
    sensor.gain_e_per_dn = gain;
    sensor.read_noise_e = 1.5;
    sensor.black_dn = 40.3;
    sensor.light_e_per_s = sensor.full_e() / 0.7;
    const Capture capture = Take(sensor, Ladder(sensor, 12));
    const PhotonTransfer result = FitPhotonTransfer(capture.pairs);
    EXPECT_FALSE(result.read_noise_resolved);
    EXPECT_LT(std::abs(result.read_variance_e2.value - 2.25), 4 * result.read_variance_e2.sigma);
    EXPECT_LT(std::abs(result.gain_e_per_dn.value - gain), 4 * result.gain_e_per_dn.sigma);
    // Every dark sample is one of two numbers; the stated error knows.
    EXPECT_LT(std::abs(result.offset_dn.value - 40.3), 3 * result.offset_dn.sigma);
    EXPECT_LT(std::abs(result.dark_current_e_per_s.value - sensor.dark_e_per_s),
              3 * result.dark_current_e_per_s.sigma);
    EXPECT_LT(result.offset_dn.sigma, 0.3);
  }
}

TEST(PhotonTransfer, LampDriftAndShadingLeaveTheGainAlone) {
  TestSensor sensor;
  sensor.seed = kSeed;
  sensor.gain_e_per_dn = 3;
  sensor.bits = 14;
  sensor.shading = 0.6;
  sensor.prnu = 0.03;
  sensor.light_e_per_s = sensor.full_e();
  const Capture capture = Take(sensor, Ladder(sensor, 12), 0.9);
  const PhotonTransfer result = FitPhotonTransfer(capture.pairs);
  EXPECT_LT(std::abs(result.gain_e_per_dn.value - 3), 4 * result.gain_e_per_dn.sigma);
  // As plain differences would have it: the pattern's tenth on top of the noise.
  double brightest = 0, plain = 0, levelled = 0;
  for (std::size_t k = 0; k < capture.pairs.size(); ++k) {
    if (result.points[k].saturated || capture.pairs[k].mean() < brightest) continue;
    brightest = capture.pairs[k].mean();
    plain = capture.pairs[k].TemporalVariance(1);
    levelled = result.points[k].variance_dn2;
  }
  EXPECT_GT(plain, 1.5 * levelled);
  EXPECT_LT(std::abs(capture.prnu_squared.value - 9e-4), 4 * capture.prnu_squared.sigma);
}

TEST(PhotonTransfer, SeesASoftFullWell) {
  // A well that overflows below the ADC's end: no sample piles up, the noise of light vanishes.
  TestSensor sensor;
  sensor.seed = kSeed;
  sensor.bits = 14;
  sensor.light_e_per_s = 5000;
  std::vector<PairStatistics> pairs = Take(sensor, Ladder(sensor, 12, 0.005, 0.6)).pairs;
  PairStatistics full = pairs[pairs.size() - 2];
  ASSERT_FALSE(full.dark);
  full.exposure_s *= 1.5;
  full.mean_a = full.mean_b = 10000;
  full.max_dn = 10030;
  full.variance_a = full.variance_b = 100;
  full.covariance = 0;
  pairs.push_back(full);
  const PhotonTransfer result = FitPhotonTransfer(pairs);
  ASSERT_TRUE(result.saturation_dn);
  EXPECT_DOUBLE_EQ(result.saturation_dn->value, 10000 - 6 * 10);
  EXPECT_TRUE(result.points.back().saturated);
  EXPECT_LT(std::abs(result.gain_e_per_dn.value - 1), 4 * result.gain_e_per_dn.sigma);
}

TEST(Linearity, FindsNoBendWhereThereIsNoneAndTheBendWhereThereIs) {
  TestSensor sensor;
  sensor.seed = kSeed;
  sensor.bits = 14;
  sensor.width = sensor.height = 128;
  sensor.light_e_per_s = sensor.full_e();
  const auto times = Ladder(sensor, 16, 0.04, 1.3);
  for (const double bend : {0.0, 0.02}) {
    sensor.bend = bend;
    const Capture capture = Take(sensor, times);
    const PhotonTransfer result = FitPhotonTransfer(capture.pairs);
    const Linearity linearity = MeasureLinearity(capture.pairs, result, 0);
    const double excess =
        (linearity.chi_squared - linearity.degrees) / std::sqrt(2.0 * linearity.degrees);
    EXPECT_EQ(linearity.repeatability, 0);
    if (bend == 0) {
      EXPECT_LT(std::abs(excess), 4);
      for (const LinearityPoint& point : linearity.points)
        EXPECT_LT(std::abs(point.deviation), 4.5 * point.sigma) << point.exposure_s;
      EXPECT_LT(std::abs(linearity.largest.deviation), 1e-3);
      continue;
    }
    EXPECT_GT(excess, 20);
    // The deviation of S = H - bend H^2 from its line, least squares over its own points.
    double n = 0, x = 0, xx = 0, y = 0, xy = 0;  // weights 1 / S^2
    const auto signal = [&](const LinearityPoint& point) {
      const double h = point.exposure_s * sensor.light_e_per_s / sensor.full_e();
      return h - bend * h * h;
    };
    for (const LinearityPoint& point : linearity.points) {
      const double s = signal(point), w = 1 / (s * s), h = point.exposure_s;
      n += w, x += w * h, xx += w * h * h, y += w * s, xy += w * h * s;
    }
    const double slope = (n * xy - x * y) / (n * xx - x * x), zero = (y - slope * x) / n;
    for (const LinearityPoint& point : linearity.points) {
      const double line = zero + slope * point.exposure_s;
      // Shading spreads the levels over some percent: a bend of a mean is not the mean bend.
      EXPECT_NEAR(point.deviation, signal(point) / line - 1, 4 * point.sigma + 2e-4)
          << point.exposure_s;
    }
    EXPECT_GT(std::abs(linearity.largest.deviation), 1.5e-3);
  }
}

TEST(Linearity, FindsTheShuttersLatencyAndTheLampsScatter) {
  TestSensor sensor;
  sensor.seed = kSeed;
  sensor.bits = 14;
  sensor.light_e_per_s = sensor.full_e();
  sensor.exposure_offset_s = 2e-3;
  const auto times = Ladder(sensor, 14, 0.06, 1.3);
  const Capture late = Take(sensor, times);
  const Linearity latency = MeasureLinearity(late.pairs, FitPhotonTransfer(late.pairs), 0);
  EXPECT_LT(std::abs(latency.exposure_offset_s.value - 2e-3), 4 * latency.exposure_offset_s.sigma);
  EXPECT_GT(latency.exposure_offset_s.value, 10 * latency.exposure_offset_s.sigma);

  // 1 % between the frames of a pair: both frames scatter by 0.5 % about their mean.
  sensor.exposure_offset_s = 0;
  Capture drifting = Take(sensor, times, 1.01);
  const PhotonTransfer transfer = FitPhotonTransfer(drifting.pairs);
  const Linearity scatter = MeasureLinearity(drifting.pairs, transfer, 0);
  EXPECT_NEAR(scatter.repeatability, 0.01 / std::sqrt(2.0), 5e-4);
  for (PairStatistics& pair : drifting.pairs) pair.meter_a = 2, pair.meter_b = 2.02;
  const Linearity monitored = MeasureLinearity(drifting.pairs, transfer, 0);
  EXPECT_TRUE(monitored.by_monitor);
  EXPECT_EQ(monitored.repeatability, 0);
}

TEST(PairStatistics, MomentsAreThoseOfTheirDefinition) {
  const session::RawFrame a{20, 10, std::vector<std::uint16_t>(200), {}};
  session::RawFrame x = a, y = a;
  PixelMask mask(200, 1);
  mask[7] = mask[150] = 0;
  double mx = 0, my = 0, n = 0;
  for (std::size_t p = 0; p < 200; ++p) {
    x.dn[p] = static_cast<std::uint16_t>(60000 + (p * 7919) % 101);
    y.dn[p] = static_cast<std::uint16_t>(60000 + (p * 104729) % 97);
    if (mask[p]) mx += x.dn[p], my += y.dn[p], n += 1;
  }
  x.dn[7] = 65535;  // masked: must not count anywhere
  mx /= n, my /= n;
  double vx = 0, vy = 0, cov = 0, difference = 0;
  for (std::size_t p = 0; p < 200; ++p) {
    if (!mask[p]) continue;
    vx += (x.dn[p] - mx) * (x.dn[p] - mx) / (n - 1);
    vy += (y.dn[p] - my) * (y.dn[p] - my) / (n - 1);
    cov += (x.dn[p] - mx) * (y.dn[p] - my) / (n - 1);
    const double d = x.dn[p] - mx - (y.dn[p] - my);
    difference += d * d / (n - 1) / 2;
  }
  const PairStatistics pair = MeasurePair(x, y, mask);
  EXPECT_EQ(pair.pixels, 198u);
  EXPECT_NEAR(pair.mean_a, mx, 1e-9);
  EXPECT_NEAR(pair.variance_a, vx, 1e-9 * vx);
  EXPECT_NEAR(pair.variance_b, vy, 1e-9 * vy);
  EXPECT_NEAR(pair.covariance, cov, 1e-9 * vx);
  EXPECT_NEAR(pair.TemporalVariance(1), difference, 1e-9 * difference);
  EXPECT_LT(pair.max_dn, 60101);
}

TEST(PairStatistics, FindsHotAndDeadPixelsAndNothingElse) {
  TestSensor sensor;
  sensor.seed = kSeed;
  sensor.width = 200;
  sensor.height = 150;
  sensor.hot = {0, 1, 777, 20000, 29999};
  sensor.dead = {5000, 5001, 12345};
  const auto indices = [&](const std::vector<std::pair<int, int>>& pixels) {
    std::vector<std::size_t> found;
    for (const auto& [row, column] : pixels)
      found.push_back(static_cast<std::size_t>(row) * 200 + column);
    return found;
  };
  EXPECT_EQ(indices(FindOutliers(sensor.Expose(0, 0.1, 1), sensor.Expose(0, 0.1, 2))), sensor.hot);
  sensor.hot.clear();
  EXPECT_EQ(indices(FindOutliers(sensor.Expose(1, 0.5, 3), sensor.Expose(1, 0.5, 4))), sensor.dead);
}

TEST(PairStatistics, PrnuIsUnbiasedDownToNoneAtAll) {
  TestSensor sensor;
  sensor.bits = 14;
  sensor.shading = 0.4;
  sensor.light_e_per_s = 8000;
  const PixelMask mask(64 * 64, 1);
  for (const double prnu : {0.0, 0.002, 0.03}) {
    sensor.prnu = prnu;
    double sum = 0, squares = 0;
    constexpr int kRuns = 60;
    for (int run = 0; run < kRuns; ++run) {
      sensor.seed = 10 * kSeed + run;
      const PatternVariance p =
          MeasurePrnuSquared(sensor.Expose(1, 1, 1), sensor.Expose(1, 1, 2), sensor.Expose(0, 1, 3),
                             sensor.Expose(0, 1, 4), mask);
      const double z = (p.value - prnu * prnu) / p.sigma;
      sum += z;
      squares += z * z;
    }
    EXPECT_LT(std::abs(sum), 3.5 * std::sqrt(kRuns)) << prnu;
    EXPECT_NEAR(squares / kRuns, 1, 4 * std::sqrt(2.0 / kRuns)) << prnu;
  }
}

TEST(PhotonTransfer, RefusesByNameWhatCannotBeCalibrated) {
  const auto refusal = [](const std::vector<PairStatistics>& pairs) -> std::string {
    try {
      const PhotonTransfer transfer = FitPhotonTransfer(pairs);
      MeasureLinearity(pairs, transfer, 0);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  TestSensor good;
  good.seed = kSeed;
  const auto times = Ladder(good, 9);
  const std::vector<PairStatistics> whole = Take(good, times).pairs;
  ASSERT_EQ(refusal(whole), "accepted");
  const auto with = [&](const std::function<void(std::vector<PairStatistics>&)>& change) {
    std::vector<PairStatistics> pairs = whole;
    change(pairs);
    return refusal(pairs);
  };
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in: " << text;
  };
  says(with([](auto& pairs) { pairs.resize(4); }), "three are needed");
  says(with([](auto& pairs) { std::erase_if(pairs, [](const auto& pair) { return !pair.dark; }); }),
       "no flats");
  says(with([](auto& pairs) {
         std::erase_if(pairs, [&](const auto& pair) {
           return pair.dark && pair.exposure_s != pairs[0].exposure_s;
         });
       }),
       "darks of 1 exposure times");
  says(with([](auto& pairs) {
         for (auto& pair : pairs)
           if (!pair.dark) pair.variance_b = pair.covariance = pair.variance_a;
       }),
       "equal");
  says(with([](auto& pairs) { std::swap(pairs[2].exposure_s, pairs[12].exposure_s); }), "darker");
  auto low = Ladder(good, 8, 0.002, 0.04);
  low.push_back(times.back());
  says(refusal(Take(good, low).pairs), "needs 4");

  TestSensor bright = good;
  bright.light_e_per_s *= 1000;
  says(refusal(Take(bright, times).pairs), "saturated");
  TestSensor dim = good;
  dim.light_e_per_s = 0.3;
  dim.dark_e_per_s = 0;
  dim.read_noise_e = 30;
  dim.black_dn = 400;
  const std::string none = refusal(Take(dim, times).pairs);
  EXPECT_TRUE(none.find("does not") != std::string::npos) << none;
  TestSensor cut = good;
  cut.black_dn = 2;
  says(refusal(Take(cut, times).pairs), "cut off at 0");

  const PixelMask mask(good.width * good.height, 1);
  TestSensor wide = good;
  wide.width = 65;
  EXPECT_THROW(MeasurePair(good.Expose(1, 1, 1), wide.Expose(1, 1, 1), mask), InputError);
  EXPECT_THROW(MeasurePair(wide.Expose(1, 1, 1), wide.Expose(1, 1, 2), mask), InputError);
  EXPECT_THROW(MeasurePair(good.Expose(1, 1, 1), good.Expose(1, 1, 2), PixelMask(64 * 64, 0)),
               InputError);
  EXPECT_THROW(MeasurePrnuSquared(good.Expose(0, 1, 1), good.Expose(0, 1, 2), good.Expose(1, 1, 3),
                                  good.Expose(1, 1, 4), mask),
               InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
