// Philox against its authors' known answers; distributions against their moments and by
// chi-squared.
#include "luxfield/core/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace luxfield::core {
namespace {

constexpr std::uint64_t kSeed = 81;

// Random123, kat_vectors: philox4x32 10.
TEST(Philox, KnownAnswers) {
  using Block = std::array<std::uint32_t, 4>;
  EXPECT_EQ(Philox({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const std::uint32_t f = 0xffffffff;
  EXPECT_EQ(Philox({f, f, f, f}, {f, f}), (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(Philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, StreamsRepeatAndDiffer) {
  Random a(kSeed, 5, 7), b(kSeed, 5, 7), other_seed(kSeed + 1, 5, 7), other_stream(kSeed, 6, 7),
      other_item(kSeed, 5, 8);
  int equal[3] = {};
  for (int k = 0; k < 1000; ++k) {
    const auto x = a();
    EXPECT_EQ(x, b());
    equal[0] += x == other_seed();
    equal[1] += x == other_stream();
    equal[2] += x == other_item();
  }
  for (const int count : equal) EXPECT_LE(count, 1);  // 1000 / 2^32 by chance
}

TEST(Random, HighBitsOfSeedAndStreamCount) {
  Random a(1, 1), b(1 + (std::uint64_t{1} << 32), 1), c(1, 1 + (std::uint64_t{1} << 32));
  const auto x = a();
  EXPECT_NE(x, b());
  EXPECT_NE(x, c());
}

// Pearson's chi-squared against its quantile by the Wilson-Hilferty approximation, at 5 sigma.
void ExpectChiSquared(const std::vector<double>& observed, const std::vector<double>& expected) {
  double chi = 0;
  for (std::size_t k = 0; k < observed.size(); ++k)
    chi += (observed[k] - expected[k]) * (observed[k] - expected[k]) / expected[k];
  const double dof = static_cast<double>(observed.size()) - 1, c = 2 / (9 * dof);
  EXPECT_LT(chi, dof * std::pow(1 - c + 5 * std::sqrt(c), 3)) << "seed " << kSeed;
  EXPECT_GT(chi, dof * std::pow(std::max(0.0, 1 - c - 5 * std::sqrt(c)), 3)) << "seed " << kSeed;
}

TEST(Random, UniformsAreUniformAndBelowOne) {
  Random random(kSeed, 1);
  const int n = 200000, bins = 64;
  std::vector<double> wide(bins), narrow(bins), expected(bins, double{n} / bins);
  for (int k = 0; k < n; ++k) {
    const double x = random.Uniform();
    const float y = random.UniformFloat();
    ASSERT_TRUE(x >= 0 && x < 1 && y >= 0 && y < 1);
    ++wide[static_cast<std::size_t>(x * bins)];
    ++narrow[static_cast<std::size_t>(y * bins)];
  }
  ExpectChiSquared(wide, expected);
  ExpectChiSquared(narrow, expected);
}

TEST(Random, NormalHasItsMomentsAndShape) {
  Random random(kSeed, 2);
  const int n = 200000;
  // Bins of 1/4 from -3 to 3 and the tails.
  const auto cdf = [](double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); };
  std::vector<double> observed(26), expected(26);
  for (int bin = 0; bin < 26; ++bin) {
    const double lo = bin == 0 ? 0 : cdf(-3 + 0.25 * (bin - 1));
    const double hi = bin == 25 ? 1 : cdf(-3 + 0.25 * bin);
    expected[bin] = n * (hi - lo);
  }
  double sum = 0, square = 0;
  for (int k = 0; k < n; ++k) {
    const double x = random.Normal();
    ASSERT_TRUE(std::isfinite(x));
    sum += x;
    square += x * x;
    ++observed[static_cast<std::size_t>(std::clamp(std::floor((x + 3) / 0.25) + 1, 0.0, 25.0))];
  }
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(square / n, 1, 5 * std::sqrt(2.0 / n));
  ExpectChiSquared(observed, expected);
}

class PoissonTest : public testing::TestWithParam<double> {};

TEST_P(PoissonTest, MomentsAndShape) {
  const double mean = GetParam();
  Random random(kSeed, 3 + static_cast<std::uint64_t>(mean * 1000));
  const int n = 100000;
  std::vector<double> draws(n);
  double sum = 0;
  for (double& draw : draws) {
    draw = random.Poisson(mean);
    ASSERT_EQ(draw, std::floor(draw));
    ASSERT_GE(draw, 0);
    sum += draw;
  }
  const double average = sum / n;
  EXPECT_NEAR(average, mean, 5 * std::sqrt(mean / n)) << "seed " << kSeed;
  double variance = 0;
  for (const double draw : draws) variance += (draw - average) * (draw - average) / n;
  // var(s^2) = (mu4 - mu2^2) / n with mu4 = mean + 3 mean^2.
  EXPECT_NEAR(variance, mean, 5 * std::sqrt((mean + 2 * mean * mean) / n)) << "seed " << kSeed;

  // Every count with an expectation of at least 20 is a bin; the tails are two.
  const auto probability = [&](double k) {
    return std::exp(k * std::log(mean) - mean - std::lgamma(k + 1));
  };
  double lo = std::floor(mean), hi = lo;
  while (lo > 0 && n * probability(lo - 1) >= 20) --lo;
  while (n * probability(hi + 1) >= 20) ++hi;
  std::vector<double> observed(static_cast<std::size_t>(hi - lo) + 2), expected(observed.size());
  double inside = 0;
  for (double k = lo; k <= hi; ++k) {
    expected[static_cast<std::size_t>(k - lo)] = n * probability(k);
    inside += n * probability(k);
  }
  expected.back() = n - inside;
  for (const double draw : draws)
    ++(draw >= lo && draw <= hi ? observed[static_cast<std::size_t>(draw - lo)] : observed.back());
  if (expected.back() < 5) {  // no tail worth a bin
    expected.pop_back();
    observed.pop_back();
  }
  ExpectChiSquared(observed, expected);
}

// Both methods, their border at 12, and large means.
INSTANTIATE_TEST_SUITE_P(Means, PoissonTest,
                         testing::Values(0.05, 1.0, 5.5, 11.99, 12.0, 30.0, 1000.0));

TEST(Poisson, ExtremesOfTheMean) {
  Random random(kSeed, 4);
  EXPECT_EQ(random.Poisson(0), 0);
  EXPECT_EQ(random.Poisson(-1), 0);
  EXPECT_EQ(random.Poisson(NAN), 0);
  for (int k = 0; k < 100; ++k) EXPECT_NEAR(random.Poisson(1e12), 1e12, 6 * 1e6);  // 6 sigma
}

}  // namespace
}  // namespace luxfield::core
