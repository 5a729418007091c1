#include "luxfield/reconstruct/bracket/excluded_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "luxfield/core/random.h"
#include "luxfield/lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

using session::RawFrame;

constexpr int kWidth = 48, kHeight = 128, kSpotRow = 64, kSpotColumn = 24;
constexpr double kField_e_per_s = 3000, kSpot_e_per_s = 3e7;

rig::SensorModel Camera() {
  rig::SensorModel sensor;
  sensor.width = kWidth;
  sensor.height = kHeight;
  sensor.bits = 14;
  sensor.gain_dn_per_e = 0.42;
  sensor.read_noise_dn = 3.34;
  sensor.black_dn = 512;
  sensor.saturation_dn = 16383;
  return sensor;
}

bool InSpot(int row, int column) {
  return std::abs(row - kSpotRow) <= 1 && std::abs(column - kSpotColumn) <= 1;
}

// A spot of 3 x 3 pixels in an even field. `share` of what its pixels cannot hold runs along the
// column, falling to 1 / e over 5 pixels.
RawFrame Expose(const rig::SensorModel& sensor, double exposure_s, double share, std::uint64_t seed,
                std::uint64_t stream) {
  const double full = (sensor.saturation_dn - sensor.black_dn) / sensor.gain_dn_per_e;
  const double q = std::exp(-1.0 / 5);
  std::vector<double> electrons, collected;
  for (int p = 0; p < kWidth * kHeight; ++p) {
    core::Random random(seed, stream, static_cast<std::uint32_t>(p));
    electrons.push_back(random.Poisson(
        exposure_s * (InSpot(p / kWidth, p % kWidth) ? kSpot_e_per_s : kField_e_per_s)));
  }
  collected = electrons;
  for (int from = 0; from < kWidth * kHeight; ++from) {
    const double over = std::max(0.0, electrons[from] - full);
    if (over == 0) continue;
    for (int row = 0; row < kHeight; ++row) {
      const int distance = std::abs(row - from / kWidth);
      if (distance > 0)
        collected[row * kWidth + from % kWidth] +=
            0.5 * share * over * (1 - q) * std::pow(q, distance - 1);
    }
  }
  RawFrame frame{kWidth, kHeight, {}, {}};
  for (int p = 0; p < kWidth * kHeight; ++p) {
    core::Random random(seed, 1000 + stream, static_cast<std::uint32_t>(p));
    const double y = sensor.black_dn + sensor.gain_dn_per_e * collected[p] +
                     sensor.read_noise_dn * random.Normal();
    frame.dn.push_back(
        static_cast<std::uint16_t>(std::clamp(std::round(y), 0.0, sensor.saturation_dn)));
  }
  return frame;
}

struct Bracket {
  std::vector<RawFrame> frames;
  std::vector<Exposure> exposures;
};

Bracket Take(const rig::SensorModel& sensor, double share, std::uint64_t seed) {
  Bracket bracket;
  for (std::uint64_t n = 0; n < 7; ++n)
    bracket.frames.push_back(
        Expose(sensor, std::ldexp(4.0, -2 * static_cast<int>(n)), share, seed, n));
  for (int n = 0; n < 7; ++n)
    bracket.exposures.push_back({&bracket.frames[n], std::ldexp(4.0, -2 * n), 1, 1, nullptr});
  return bracket;
}

TEST(ExcludedSamples, LeavesOutTheColumnThatOverflowReaches) {
  // The spot of the longest exposure holds 1.2e8 electrons where 38000 fit: the column gets 1e6 a
  // pixel, falling, which is the field's own after 20 pixels and its noise after 45.
  const rig::SensorModel sensor = Camera();
  constexpr int kRuns = 20;
  double pulls = 0, squares = 0, n = 0, largest = 0;
  for (int run = 0; run < kRuns; ++run) {
    const Bracket bracket = Take(sensor, 0.3, 50 + static_cast<std::uint64_t>(run));
    const MergedFrame merged = MergeExposures(sensor, bracket.exposures);
    for (int row = 0; row < kHeight; ++row)
      for (int column = kSpotColumn - 1; column <= kSpotColumn + 1; ++column) {
        const std::size_t p = static_cast<std::size_t>(row) * kWidth + column;
        // The spot's neighbours are left out of every exposure that clips there.
        if (merged.mask[p] & lightfield::kUnknownMask || std::abs(row - kSpotRow) <= 2) continue;
        const double pull = (merged.rate_e_per_s[p] - kField_e_per_s) / merged.sigma_e_per_s[p];
        pulls += pull;
        squares += pull * pull;
        largest = std::max(largest, std::abs(pull));
        ++n;
      }
  }
  std::printf("overflowed columns: mean pull %.3f, rms %.3f, largest %.2f (%g pixels)\n", pulls / n,
              std::sqrt(squares / n), largest, n);
  EXPECT_LT(std::abs(pulls / n), 0.05);
  EXPECT_LT(std::sqrt(squares / n), 1.05);
  EXPECT_LT(largest, 5.5);
}

bool Clipped(const RawFrame& frame) {
  return *std::max_element(frame.dn.begin(), frame.dn.end()) >= 16383;
}

TEST(ExcludedSamples, WithoutOverflowLittleElseIsLeftOut) {
  const rig::SensorModel sensor = Camera();
  double beyond = 0, samples = 0;
  for (std::uint64_t seed = 200; seed < 220; ++seed) {
    const Bracket bracket = Take(sensor, 0, seed);
    const ExcludedSamples excluded(sensor, bracket.exposures);
    for (std::size_t n = 0; n < bracket.frames.size(); ++n) {
      if (!Clipped(bracket.frames[n])) continue;
      for (int p = 0; p < kWidth * kHeight; ++p) {
        const bool out = excluded.At(n, p / kWidth, p % kWidth);
        const bool near =
            std::abs(p / kWidth - kSpotRow) <= 2 && std::abs(p % kWidth - kSpotColumn) <= 2;
        if (near) {
          EXPECT_TRUE(out);
        } else {
          beyond += out;
          ++samples;
        }
      }
    }
  }
  // 12 ends a frame, each passing by chance one time in 700, 8 samples then.
  EXPECT_LT(beyond / samples, 1e-3);
}

// Charge that runs down a column and from there along one row, in frames without noise: what it
// adds to unclipped samples is far beyond their noise (33 DN).
TEST(ExcludedSamples, RowsAreFollowedFromWhatColumnsLeaveOut) {
  constexpr int kColumns = 130, kRow = 75;
  rig::SensorModel sensor = Camera();
  sensor.width = kColumns;
  const auto flat = static_cast<std::uint16_t>(512 + 0.42 * kField_e_per_s);
  RawFrame shorter{kColumns, kHeight, std::vector<std::uint16_t>(kColumns * kHeight, flat), {}};
  RawFrame longer = shorter;
  for (auto& dn : longer.dn) dn = static_cast<std::uint16_t>(512 + 4 * (flat - 512));
  for (const int column : {24, 90}) {
    longer.dn[kSpotRow * kColumns + column] = 16383;
    for (int row = kSpotRow + 1; row <= 80; ++row) longer.dn[row * kColumns + column] += 3000;
    for (int beside = 1; beside <= 6; ++beside)
      longer.dn[kRow * kColumns + column + beside] += 1000;
  }
  const std::vector<Exposure> exposures{{&longer, 4, 1, 1, nullptr}, {&shorter, 1, 1, 1, nullptr}};
  const ExcludedSamples excluded(sensor, exposures);
  for (const int column : {24, 90})
    for (int beside = 2; beside <= 6; ++beside) {
      EXPECT_TRUE(excluded.At(0, kRow, column + beside)) << column << " + " << beside;
      EXPECT_FALSE(excluded.At(0, kRow - 5, column + beside)) << column << " + " << beside;
    }
}

// Samples that clip here and there in one frame, where nothing tells how far they run over: they
// and their neighbours are left out, at the sensor's borders and across those of words too.
TEST(ExcludedSamples, NeighboursOfClippedSamples) {
  for (const int width : {1, 2, 63, 64, 65, 130}) {
    constexpr int kRows = 40;
    rig::SensorModel sensor = Camera();
    sensor.width = width;
    sensor.height = kRows;
    RawFrame whole{width, kRows, std::vector<std::uint16_t>(width * kRows, 600), {}};
    RawFrame real{width, kRows, {}, std::vector<float>(width * kRows, 600.0f)};
    core::Random random(77, static_cast<std::uint64_t>(width));
    for (int k = 0; k < 12; ++k) {
      const auto p = static_cast<std::size_t>(random.Uniform() * width * kRows);
      whole.dn[p] = k % 2 == 0 ? 16383 : 65535;
      real.value[p] = k % 2 == 0 ? 16383.0f : std::numeric_limits<float>::quiet_NaN();
    }
    for (const RawFrame* frame : {&whole, &real}) {
      const std::vector<Exposure> one{{frame, 1, 1, 1, nullptr}};
      const ExcludedSamples excluded(sensor, one);
      for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < width; ++column) {
          bool near = false;
          for (int r = std::max(row - 1, 0); r <= std::min(row + 1, kRows - 1); ++r)
            for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
              near |= !(frame->at(static_cast<std::size_t>(r) * width + c) < 16383);
          EXPECT_EQ(excluded.At(0, row, column), near) << width << ": " << row << ", " << column;
        }
    }
  }
}

}  // namespace
}  // namespace luxfield::reconstruct
