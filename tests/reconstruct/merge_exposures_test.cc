#include "luxfield/reconstruct/bracket/merge_exposures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

using session::RawFrame;

constexpr std::uint64_t kSeed = 2020;
constexpr int kSize = 200;

// A 14-bit camera with 8 electrons of read noise; like the one of Hanji et al. 2020.
rig::SensorModel Camera(int size = kSize) {
  rig::SensorModel sensor;
  sensor.width = sensor.height = size;
  sensor.bits = 14;
  sensor.gain_dn_per_e = 0.42;
  sensor.read_noise_dn = 3.34;
  sensor.black_dn = 512;
  sensor.saturation_dn = 16383;
  return sensor;
}

RawFrame Expose(const rig::SensorModel& sensor, double electrons_per_s, double exposure_s,
                std::uint64_t stream) {
  RawFrame frame{sensor.width, sensor.height, {}, {}};
  for (std::size_t p = 0; p < frame.size(); ++p) {
    core::Random random(kSeed, stream, static_cast<std::uint32_t>(p));
    const double electrons =
        random.Poisson((electrons_per_s + sensor.dark_current_e_per_s) * exposure_s);
    const double y = std::round(sensor.gain_dn_per_e * electrons +
                                sensor.read_noise_dn * random.Normal() + sensor.black_dn);
    frame.dn.push_back(static_cast<std::uint16_t>(std::clamp(y, 0.0, sensor.saturation_dn)));
  }
  return frame;
}

struct Bracket {
  std::vector<RawFrame> frames;
  std::vector<Exposure> exposures;
};

Bracket TakeBracket(const rig::SensorModel& sensor, double electrons_per_s,
                    const std::vector<double>& times_s, std::uint64_t stream) {
  Bracket bracket;
  for (const double t : times_s)
    bracket.frames.push_back(Expose(sensor, electrons_per_s, t, ++stream));
  for (std::size_t n = 0; n < times_s.size(); ++n)
    bracket.exposures.push_back({&bracket.frames[n], times_s[n], 1, 1, nullptr});
  return bracket;
}

struct Statistics {
  double mean = 0, spread = 0, rms_sigma = 0;
  std::size_t count = 0;
};

Statistics Summarise(const MergedFrame& merged) {
  Statistics s;
  double squares = 0, variances = 0;
  for (std::size_t p = 0; p < merged.mask.size(); ++p) {
    if (merged.mask[p] & lightfield::kUnknownMask) continue;
    ++s.count;
    s.mean += merged.rate_e_per_s[p];
    squares += static_cast<double>(merged.rate_e_per_s[p]) * merged.rate_e_per_s[p];
    variances += static_cast<double>(merged.sigma_e_per_s[p]) * merged.sigma_e_per_s[p];
  }
  const double n = static_cast<double>(s.count);
  s.mean /= n;
  s.spread = std::sqrt(squares / n - s.mean * s.mean);
  s.rms_sigma = std::sqrt(variances / n);
  return s;
}

// The smallest standard deviation of an unbiased linear combination of the exposures that stay
// below saturation.
double IdealSigma(const rig::SensorModel& sensor, double x, const std::vector<double>& times_s) {
  const double g = sensor.gain_dn_per_e;
  const double other = (sensor.read_noise_dn * sensor.read_noise_dn + 1.0 / 12) / (g * g);
  double information = 0;
  for (const double t : times_s)
    if (sensor.black_dn + g * t * x < sensor.saturation_dn) information += t * t / (x * t + other);
  return 1 / std::sqrt(information);
}

const std::vector<double> kTimes{1.0 / 1000, 1.0 / 125, 1.0 / 15, 0.5, 4};

class Level : public testing::TestWithParam<double> {};

TEST_P(Level, IsUnbiasedAndAsNoisyAsItMustBe) {
  const double x = GetParam();
  const rig::SensorModel sensor = Camera();
  const Bracket bracket = TakeBracket(sensor, x, kTimes, 100);
  const Statistics s = Summarise(MergeExposures(sensor, bracket.exposures));
  const double ideal = IdealSigma(sensor, x, kTimes), n = static_cast<double>(s.count);
  EXPECT_EQ(s.count, static_cast<std::size_t>(kSize) * kSize);
  EXPECT_LT(std::abs(s.mean - x), 4 * ideal / std::sqrt(n)) << "seed " << kSeed;
  // A sample deviation scatters by 1 / sqrt(2 n) = 0.35 %.
  EXPECT_NEAR(s.spread / ideal, 1, 4 / std::sqrt(2 * n));
  EXPECT_NEAR(s.rms_sigma / s.spread, 1, 4 / std::sqrt(2 * n));
}

INSTANTIATE_TEST_SUITE_P(ElectronsPerSecond, Level, testing::Values(30, 300, 3e4, 1e6));

TEST(MergeExposures, DecidesSaturationWithoutBias) {
  // The half-second exposure is predicted to lie at the margin: about half of the pixels use it.
  // Deciding by a sample's own value there is biased by -0.3 %.
  const rig::SensorModel sensor = Camera();
  for (const double x : {73000.0, 73500.0, 73650.0, 74000.0, 75000.0, 76000.0}) {
    const Bracket bracket = TakeBracket(sensor, x, kTimes, 200);
    const MergedFrame merged = MergeExposures(sensor, bracket.exposures);
    const Statistics s = Summarise(merged);
    EXPECT_EQ(s.count, merged.mask.size());
    EXPECT_LT(std::abs(s.mean - x), 4 * s.spread / std::sqrt(static_cast<double>(s.count))) << x;
    EXPECT_LT(std::abs(s.mean / x - 1), 3e-4) << x;
  }
}

TEST(MergeExposures, PoissonEstimatorIsUnbiasedAndNoisierInTheDark) {
  const rig::SensorModel sensor = Camera();
  const Bracket bracket = TakeBracket(sensor, 30, kTimes, 300);
  MergeOptions options;
  options.estimator = Estimator::kPoisson;
  const Statistics poisson = Summarise(MergeExposures(sensor, bracket.exposures, options));
  const Statistics weighted = Summarise(MergeExposures(sensor, bracket.exposures));
  const double n = static_cast<double>(poisson.count);
  EXPECT_LT(std::abs(poisson.mean - 30), 4 * poisson.spread / std::sqrt(n));
  EXPECT_NEAR(poisson.rms_sigma / poisson.spread, 1, 4 / std::sqrt(2 * n));
  EXPECT_NEAR(poisson.spread / weighted.spread, 1.4, 0.03);  // docs/theory.md 3: about 40 % noisier
}

TEST(MergeExposures, HoldsFrom8To16Bits) {
  for (const int bits : {8, 10, 12, 14, 16}) {
    rig::SensorModel sensor = Camera(100);
    sensor.bits = bits;
    sensor.saturation_dn = (1 << bits) - 1;
    sensor.black_dn = sensor.saturation_dn / 16;
    sensor.gain_dn_per_e = sensor.saturation_dn / 20000;
    sensor.read_noise_dn = 4 * sensor.gain_dn_per_e;
    const double x = 8000;
    // 8 bits: a step is 78 electrons and the shot noise of 8000 electrons is 89, which dithers it.
    const Bracket bracket =
        TakeBracket(sensor, x, {1, 0.25}, 400 + static_cast<std::uint64_t>(bits));
    const Statistics s = Summarise(MergeExposures(sensor, bracket.exposures));
    const double n = static_cast<double>(s.count);
    EXPECT_LT(std::abs(s.mean - x), 4 * s.spread / std::sqrt(n)) << bits;
    EXPECT_NEAR(s.rms_sigma / s.spread, 1, 4 / std::sqrt(2 * n) + 0.01) << bits;
  }
}

// The estimating equation solved in double by the plain fixed point of Granados et al. 2010.
double FixedPoint(const rig::SensorModel& sensor, const std::vector<double>& times_s,
                  const std::vector<double>& signal_dn, double* sigma) {
  const double g = sensor.gain_dn_per_e,
               other = sensor.read_noise_dn * sensor.read_noise_dn + 1.0 / 12;
  double x = 0, k_sum = 0;
  for (std::size_t n = 0; n < times_s.size(); ++n) {
    x += signal_dn[n];
    k_sum += g * times_s[n];
  }
  x /= k_sum;
  for (int iteration = 0; iteration < 200; ++iteration) {
    double numerator = 0, weights = 0;
    for (std::size_t n = 0; n < times_s.size(); ++n) {
      const double k = g * times_s[n], variance = g * k * std::max(x, 0.0) + other;
      numerator += k * signal_dn[n] / variance;
      weights += k * k / variance;
    }
    x = numerator / weights;
    *sigma = 1 / std::sqrt(weights);
  }
  return x;
}

TEST(MergeExposures, SolvesTheEstimatingEquationToItsStatedRounding) {
  // 8 exposures over 14 stops, light over 17; sizes that fill no vector.
  rig::SensorModel sensor = Camera();
  sensor.width = 61;
  sensor.height = 37;
  std::vector<double> times_s;
  for (int n = 0; n < 8; ++n) times_s.push_back(std::ldexp(4.0, -2 * n));
  for (int stop = 0; stop <= 17; ++stop) {
    const double x = 30 * std::ldexp(1.0, stop);
    std::vector<double> clear_s;  // no sample of these comes near saturation
    for (const double t : times_s)
      if (0.42 * t * x < 13000) clear_s.push_back(t);
    const Bracket bracket =
        TakeBracket(sensor, x, clear_s, 1000 + 10 * static_cast<std::uint64_t>(stop));
    const MergedFrame merged = MergeExposures(sensor, bracket.exposures);
    for (std::size_t p = 0; p < merged.mask.size(); ++p) {
      std::vector<double> signal_dn;
      for (const RawFrame& frame : bracket.frames) signal_dn.push_back(frame.at(p) - 512.0);
      double sigma = 0;
      const double expected = FixedPoint(sensor, clear_s, signal_dn, &sigma);
      ASSERT_NEAR(merged.rate_e_per_s[p], expected, 1e-4 * sigma + 1e-6 * std::abs(expected))
          << "stop " << stop << ", pixel " << p;
      ASSERT_NEAR(merged.sigma_e_per_s[p] / sigma, 1, 1e-3);
    }
  }
}

// Newton's method starts where neighbours that are as bright as each other would have it: of pixels
// beside ones 2^8 times as bright it takes steps of its own.
TEST(MergeExposures, SolvesItBesideNeighboursOfOtherBrightness) {
  rig::SensorModel sensor = Camera();
  sensor.width = 61;
  sensor.height = 37;
  std::vector<double> times_s;
  for (int n = 0; n < 8; ++n) times_s.push_back(std::ldexp(4.0, -2 * n));
  std::vector<Bracket> stops;
  for (int stop = 0; stop <= 8; ++stop)
    stops.push_back(TakeBracket(sensor, 24 * std::ldexp(1.0, stop), times_s,
                                2000 + 10 * static_cast<std::uint64_t>(stop)));
  std::vector<RawFrame> frames = stops[0].frames;
  for (std::size_t n = 0; n < frames.size(); ++n)
    for (std::size_t p = 0; p < frames[n].size(); ++p)
      frames[n].dn[p] = stops[p * 7 % stops.size()].frames[n].dn[p];
  std::vector<Exposure> exposures;
  for (std::size_t n = 0; n < frames.size(); ++n)
    exposures.push_back({&frames[n], times_s[n], 1, 1, nullptr});
  const MergedFrame merged = MergeExposures(sensor, exposures);
  for (std::size_t p = 0; p < merged.mask.size(); ++p) {
    std::vector<double> signal_dn;
    for (const RawFrame& frame : frames) signal_dn.push_back(frame.at(p) - 512.0);
    double sigma = 0;
    const double expected = FixedPoint(sensor, times_s, signal_dn, &sigma);
    ASSERT_NEAR(merged.rate_e_per_s[p], expected, 1e-4 * sigma + 1e-6 * std::abs(expected)) << p;
    ASSERT_NEAR(merged.sigma_e_per_s[p] / sigma, 1, 1e-3) << p;
  }
}

TEST(MergeExposures, AveragesDarksTogetherAsOneByOne) {
  rig::SensorModel sensor = Camera();
  sensor.width = 301;  // pieces and vectors that are not whole
  sensor.height = 97;
  std::vector<RawFrame> frames;
  for (std::uint64_t n = 0; n < 5; ++n) frames.push_back(Expose(sensor, 40, 1, 900 + n));
  DarkSum by_parts(1);
  by_parts.Add(std::span(frames).first(2));
  for (std::size_t n = 2; n < frames.size(); ++n) by_parts.Add(frames[n]);
  const DarkFrame parts = by_parts.Mean(), together = AverageDarks(frames, 1);
  EXPECT_EQ(parts.mean_dn, together.mean_dn);
  EXPECT_EQ(together.count, 5);
  for (std::size_t p = 0; p < frames[0].size(); ++p) {
    double sum = 0;
    for (const RawFrame& frame : frames) sum += frame.dn[p];
    ASSERT_FLOAT_EQ(together.mean_dn[p], static_cast<float>(sum / 5)) << p;
  }
}

TEST(MergeExposures, DoesNotTrustWhatIsTooCoarseOrClippedAtZero) {
  // 20 electrons per DN and hardly any read noise: 1 s of 30 electrons per second is always 1 or 2
  // DN, so that rounding is a bias; 4 s of it have the shot noise to dither.
  rig::SensorModel coarse = Camera();
  coarse.gain_dn_per_e = 0.05;
  coarse.read_noise_dn = 0.1;
  const Bracket bracket = TakeBracket(coarse, 30, kTimes, 2000);
  const Statistics s = Summarise(MergeExposures(coarse, bracket.exposures));
  const double n = static_cast<double>(s.count);
  EXPECT_LT(std::abs(s.mean - 30), 4 * s.spread / std::sqrt(n));
  // Black level 4 DN, read noise 3.3: short exposures lose what the noise takes below 0.
  rig::SensorModel low = Camera();
  low.black_dn = 4;
  const Statistics t = Summarise(MergeExposures(low, TakeBracket(low, 30, kTimes, 2100).exposures));
  EXPECT_EQ(t.count, static_cast<std::size_t>(kSize) * kSize);
  EXPECT_LT(std::abs(t.mean - 30), 4 * t.spread / std::sqrt(static_cast<double>(t.count)));
  // Too little light for such a camera: flagged, never a number.
  const MergedFrame dark = MergeExposures(low, TakeBracket(low, 1, kTimes, 2200).exposures);
  for (std::size_t p = 0; p < dark.mask.size(); ++p) {
    ASSERT_EQ(dark.mask[p], lightfield::kBelowBlack);
    ASSERT_EQ(dark.rate_e_per_s[p], 0);
  }
}

// A pixel that clips takes its neighbours' samples of that exposure along, and nobody else's: theirs
// may hold anything, and all others are as without it. In the dark too, where samples are looked at
// one by one: a black level of 4 DN under a read noise of 3.3.
TEST(MergeExposures, InTheDarkAPixelLeavesOutItsOwnSamplesAlone) {
  rig::SensorModel low = Camera(20);
  low.black_dn = 4;
  constexpr int kRow = 8, kColumn = 9;
  const auto merged = [&](std::optional<int> clipped_dn, int beside_dn) {
    Bracket bracket = TakeBracket(low, 30, kTimes, 2300);
    RawFrame& longest = bracket.frames.back();
    if (clipped_dn)
      for (int row = kRow - 1; row <= kRow + 1; ++row)
        for (int column = kColumn - 1; column <= kColumn + 1; ++column)
          longest.dn[row * 20 + column] = static_cast<std::uint16_t>(
              row == kRow && column == kColumn ? *clipped_dn : beside_dn);
    return MergeExposures(low, bracket.exposures);
  };
  const MergedFrame without = merged({}, 0), with = merged(16383, 50), other = merged(16383, 20);
  for (int row = 0; row < 20; ++row)
    for (int column = 0; column < 20; ++column) {
      const std::size_t p = row * 20 + column;
      const bool beside = std::abs(row - kRow) <= 1 && std::abs(column - kColumn) <= 1;
      const MergedFrame& same = beside ? other : without;
      EXPECT_EQ(with.rate_e_per_s[p], same.rate_e_per_s[p]) << row << ", " << column;
      EXPECT_EQ(with.sigma_e_per_s[p], same.sigma_e_per_s[p]) << row << ", " << column;
    }
}

// One pixel among equal ones, exact numbers.
RawFrame Flat(const rig::SensorModel& sensor, double dn) {
  RawFrame frame{sensor.width, sensor.height, {}, {}};
  frame.dn.assign(frame.size(), static_cast<std::uint16_t>(dn));
  return frame;
}

TEST(MergeExposures, MergesAcrossARatioOf2To17) {
  const rig::SensorModel sensor = Camera(3);
  const double long_s = 1, short_s = 0x1p-17;
  // Sun: the long exposure clips, the short one sees 10000 DN.
  const RawFrame clipped = Flat(sensor, 16383), sun = Flat(sensor, 10512);
  const std::vector<Exposure> bright{{&clipped, long_s, 1, 1, nullptr},
                                     {&sun, short_s, 1, 1, nullptr}};
  EXPECT_NEAR(MergeExposures(sensor, bright).rate_e_per_s[4], 10000 / 0.42 * 0x1p17,
              1e-6 * 10000 / 0.42 * 0x1p17);
  // Sky: the short one sees noise, which must not count.
  const RawFrame sky = Flat(sensor, 4512), noise = Flat(sensor, 517);
  const std::vector<Exposure> dim{{&sky, long_s, 1, 1, nullptr}, {&noise, short_s, 1, 1, nullptr}};
  const MergedFrame merged = MergeExposures(sensor, dim);
  // The short one's 1.6e6 electrons per second come in with a weight of 9e-9.
  EXPECT_NEAR(merged.rate_e_per_s[4], 4000 / 0.42, 0.02);
  EXPECT_NEAR(merged.count[4], 1, 1e-6);
  EXPECT_EQ(merged.mask[4], 0u);
}

TEST(MergeExposures, FlagsWhatClipsEverywhereAndInventsNothing) {
  const rig::SensorModel sensor = Camera(5);
  RawFrame frame = Flat(sensor, 2000);
  frame.dn[12] = 16383;  // the middle
  const std::vector<Exposure> one{{&frame, 1, 1, 1, nullptr}};
  const MergedFrame merged = MergeExposures(sensor, one);
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 5; ++column) {
      const bool near = std::abs(row - 2) <= 1 && std::abs(column - 2) <= 1;  // blooming
      EXPECT_EQ(merged.mask[row * 5 + column], near ? lightfield::kSaturated : 0u);
      EXPECT_EQ(merged.rate_e_per_s[row * 5 + column] == 0, near);
    }
}

TEST(MergeExposures, EstimatesButReportsNoNegativeValuesAndSinglePhotons) {
  const rig::SensorModel sensor = Camera(3);
  const RawFrame dim = Flat(sensor, 500), one_photon = Flat(sensor, 513);
  const std::vector<Exposure> dark{{&dim, 2, 1, 1, nullptr}};
  const MergedFrame negative = MergeExposures(sensor, dark);
  EXPECT_NEAR(negative.rate_e_per_s[0], -12 / 0.84, 1e-5);
  EXPECT_EQ(negative.mask[0], lightfield::kTooDark);
  EXPECT_FALSE(negative.Number(0));
  EXPECT_NEAR(negative.sigma_e_per_s[0], std::sqrt(3.34 * 3.34 + 1.0 / 12) / 0.84, 1e-5);
  const RawFrame nothing = Flat(sensor, 0);  // 150 standard deviations below the black level
  const std::vector<Exposure> wrong{{&nothing, 2, 1, 1, nullptr}};
  const MergedFrame below = MergeExposures(sensor, wrong);
  EXPECT_EQ(below.mask[4], lightfield::kBelowBlack);
  EXPECT_EQ(below.rate_e_per_s[4], 0);
  EXPECT_FALSE(below.Number(4));
  const std::vector<Exposure> photon{{&one_photon, 1, 1, 1, nullptr}};
  const MergedFrame single = MergeExposures(sensor, photon);
  EXPECT_NEAR(single.rate_e_per_s[0], 1 / 0.42, 1e-5);
  EXPECT_EQ(single.mask[0], lightfield::kTooDark);
  EXPECT_FALSE(single.Number(0));
  const RawFrame bright = Flat(sensor, 2000);
  const std::vector<Exposure> detected{{&bright, 1, 1, 1, nullptr}};
  const MergedFrame number = MergeExposures(sensor, detected);
  EXPECT_EQ(number.Number(0), number.rate_e_per_s[0]);
}

TEST(MergeExposures, ScalesWithAttenuationAndLamp) {
  const rig::SensorModel sensor = Camera(3);
  const RawFrame frame = Flat(sensor, 4712);
  const std::vector<Exposure> one{{&frame, 2, 0.1, 0.95, nullptr}};
  const MergedFrame merged = MergeExposures(sensor, one);
  EXPECT_NEAR(merged.rate_e_per_s[0], 4200 / 0.42 / (2 * 0.1 * 0.95), 0.01);
}

TEST(MergeExposures, KeepsPrnuOutOfTheWeights) {
  rig::SensorModel sensor = Camera(3);
  const RawFrame a = Flat(sensor, 8512), b = Flat(sensor, 2512);
  const std::vector<Exposure> two{{&a, 1, 1, 1, nullptr}, {&b, 0.25, 1, 1, nullptr}};
  const MergedFrame without = MergeExposures(sensor, two);
  sensor.prnu = 0.01;
  const MergedFrame with = MergeExposures(sensor, two);
  EXPECT_EQ(with.rate_e_per_s, without.rate_e_per_s);
  const double prnu = 0.01 * without.rate_e_per_s[0];
  EXPECT_NEAR(with.sigma_e_per_s[0], std::hypot(without.sigma_e_per_s[0], prnu), 1e-4 * prnu);
}

TEST(MergeExposures, SubtractsDarksAndCarriesTheirVariance) {
  rig::SensorModel sensor = Camera(60);
  sensor.dark_current_e_per_s = 200;
  constexpr int kDarks = 4;
  DarkSum sum(2);
  for (int n = 0; n < kDarks; ++n)
    sum.Add(Expose(sensor, 0, 2, 500 + static_cast<std::uint64_t>(n)));
  const DarkFrame dark = sum.Mean();
  EXPECT_EQ(dark.count, kDarks);
  const RawFrame frame = Expose(sensor, 500, 2, 600);
  const std::vector<Exposure> with{{&frame, 2, 1, 1, &dark}}, without{{&frame, 2, 1, 1, nullptr}};
  for (const auto& [exposures, darks] : {std::pair(with, 1.0 / kDarks), std::pair(without, 0.0)}) {
    const Statistics s = Summarise(MergeExposures(sensor, exposures));
    const double n = static_cast<double>(s.count), g = sensor.gain_dn_per_e;
    const double other = 3.34 * 3.34 + 1.0 / 12 + g * g * 400;
    const double expected = std::sqrt(g * g * 1000 + other * (1 + darks)) / (2 * g);
    EXPECT_LT(std::abs(s.mean - 500), 4 * expected / std::sqrt(n));
    EXPECT_NEAR(s.spread / expected, 1, 4 / std::sqrt(2 * n));
    EXPECT_NEAR(s.rms_sigma / expected, 1, 0.01);
  }
}

TEST(MergeExposures, MarksDefects) {
  rig::SensorModel sensor = Camera(4);
  sensor.defects = {{1, 2}};
  const RawFrame frame = Flat(sensor, 2000);
  const std::vector<Exposure> one{{&frame, 1, 1, 1, nullptr}};
  const MergedFrame merged = MergeExposures(sensor, one);
  for (int p = 0; p < 16; ++p) EXPECT_EQ(merged.mask[p], p == 6 ? lightfield::kDefect : 0u);
}

TEST(MergeExposures, TakesFloatFramesAndTreatsNanAsClipped) {
  rig::SensorModel sensor = Camera(1);
  sensor.bits = 32;
  RawFrame frame{1, 1, {}, {512.25f}}, bad{1, 1, {}, {NAN}};
  const std::vector<Exposure> good{{&frame, 1, 1, 1, nullptr}}, nan{{&bad, 1, 1, 1, nullptr}};
  EXPECT_NEAR(MergeExposures(sensor, good).rate_e_per_s[0], 0.25 / 0.42, 1e-6);
  EXPECT_EQ(MergeExposures(sensor, nan).mask[0], lightfield::kSaturated);
}

TEST(MergeExposures, RefusesWhatCannotBe) {
  const rig::SensorModel sensor = Camera(3);
  const RawFrame frame = Flat(sensor, 2000), small{2, 3, std::vector<std::uint16_t>(6), {}};
  const auto merge = [&](const Exposure& exposure) {
    MergeExposures(sensor, std::vector<Exposure>{exposure});
  };
  EXPECT_THROW(MergeExposures(sensor, {}), InputError);
  EXPECT_THROW(merge({&small, 1, 1, 1, nullptr}), InputError);
  EXPECT_THROW(merge({&frame, 0, 1, 1, nullptr}), InputError);
  EXPECT_THROW(merge({&frame, 1, -1, 1, nullptr}), InputError);
  EXPECT_THROW(merge({&frame, 1, 1, NAN, nullptr}), InputError);
  DarkSum sum(1);
  EXPECT_THROW(sum.Mean(), InputError);
  sum.Add(frame);
  EXPECT_THROW(sum.Add(small), InputError);
}

}  // namespace
}  // namespace luxfield::reconstruct
