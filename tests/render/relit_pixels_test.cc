// The estimate of a picture's noise from pixels that are lit again, against made-up pictures whose
// noise is known.
#include "luxfield/render/film/relit_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <set>

namespace luxfield::render {
namespace {

constexpr std::uint64_t kSeed = 5;

// Pixel k has the variance (1 + k mod 7)^2, every hundredth a hundred times as much. A pass states
// twenty times that, times a factor of its own; some pixels state nothing.
double TrueVariance(std::size_t k) {
  const double sigma = 1 + static_cast<double>(k % 7);
  return sigma * sigma * (k % 100 == 7 ? 100 : 1);
}
std::vector<float> Stated(std::size_t pixels) {
  std::vector<float> stated;
  for (std::size_t k = 0; k < pixels; ++k)
    stated.push_back(static_cast<float>(10 * TrueVariance(k) * static_cast<double>(k % 5)));
  return stated;
}

struct Estimate {
  double sum = 0, log_variance = 0;  // of variances
};

Estimate Measure(std::uint64_t seed, const std::vector<float>& stated) {
  core::Random random(kSeed, seed);
  RelitPixels relit(seed);
  relit.Start(stated.size(), 0);
  const auto draws = relit.Choose(stated, stated);
  std::vector<std::vector<double>> luminance(relit.runs());
  for (auto& of_run : luminance)
    for (const auto& draw : draws)
      of_run.push_back(3 + std::sqrt(TrueVariance(draw.pixel)) * random.Normal());
  relit.Add(draws, luminance);
  double all = 0;
  for (const float s : stated) all += s;
  return {relit.Scale() * all, relit.LogVariance()};
}

// The sum's mean, and how far it scatters, against what it says of itself.
TEST(RelitPixels, TheSumOfVariancesIsTrueAndKnowsHowWell) {
  constexpr int kRuns = 500;
  for (const std::size_t pixels : {1728, 40000}) {
    const auto stated = Stated(pixels);
    double truth = 0;
    for (std::size_t k = 0; k < pixels; ++k) truth += TrueVariance(k);
    double sum = 0, squares = 0, says = 0;
    for (int run = 0; run < kRuns; ++run) {
      const Estimate estimate = Measure(run, stated);
      const double error = estimate.sum / truth - 1;
      sum += error;
      squares += error * error;
      says += estimate.log_variance * std::pow(estimate.sum / truth, 2);
    }
    const double mean = sum / kRuns, variance = squares / kRuns - mean * mean;
    std::printf("%zu pixels: off by %.4f +- %.4f, scatters by %.4f, says %.4f, seed %d\n", pixels,
                mean, std::sqrt(variance / kRuns), std::sqrt(variance), std::sqrt(says / kRuns),
                static_cast<int>(kSeed));
    EXPECT_LT(std::abs(mean), 4 * std::sqrt(variance / kRuns));
    EXPECT_LT(variance, 0.25);
    // A variance of 500 values scatters by 6 %, somewhat more for these; draws at even distances
    // scatter less than the independent ones that they are taken for.
    EXPECT_GT(says / kRuns, 0.75 * variance);
    EXPECT_LT(says / kRuns, 1.6 * variance);
  }
}

// Every pixel is drawn as often as its weight says, even one that states nothing.
TEST(RelitPixels, DrawsComeAsOftenAsTheirWeightSays) {
  const auto stated = Stated(700);
  constexpr int kRuns = 2000;
  std::vector<double> weight(stated.size(), 0.0), count(stated.size(), 0.0);
  for (int run = 0; run < kRuns; ++run) {
    RelitPixels relit(run);
    relit.Start(stated.size(), 0);
    const auto draws = relit.Choose(stated, stated);
    EXPECT_EQ(draws.size(), 128u);
    EXPECT_EQ(relit.drawn(), 128u);
    for (const auto& draw : draws) {
      weight[draw.pixel] = draw.weight;
      ++count[draw.pixel];
    }
  }
  double weighted = 0;
  for (std::size_t k = 0; k < stated.size(); ++k) {
    ASSERT_GT(count[k], 0) << k;
    const double expected = kRuns / weight[k];
    EXPECT_LT(std::abs(count[k] - expected), 5 * std::sqrt(expected)) << k;
    weighted += weight[k] * count[k] / kRuns;
  }
  EXPECT_NEAR(weighted / static_cast<double>(stated.size()), 1, 0.01);
}

TEST(RelitPixels, RunsDrawIndependently) {
  std::set<std::uint64_t> seeds{kSeed, kSeed + 1};
  for (const std::uint64_t seed : {kSeed, kSeed + 1}) {
    const RelitPixels relit(seed);
    for (int run = 0; run < 32; ++run) EXPECT_TRUE(seeds.insert(relit.Seed(run)).second);
  }
}

// Pixels of one set err alike: there are no more observations than runs.
TEST(RelitPixels, SharedSetsAreKnownByTheRuns) {
  RelitPixels relit(kSeed);
  relit.Start(40000, 1);
  ASSERT_GE(relit.runs(), 16);
  core::Random random(kSeed, 1);
  const std::vector<float> stated(40000, 10.0f);
  const auto draws = relit.Choose(stated, stated);
  std::vector<std::vector<double>> luminance;
  for (int run = 0; run < relit.runs(); ++run)
    luminance.emplace_back(draws.size(), 1 + random.Normal());
  relit.Add(draws, luminance);
  EXPECT_NEAR(relit.LogVariance(), 2.0 / (relit.runs() - 1), 1e-9);
  EXPECT_LT(std::abs(std::log(10 * relit.Scale())), 4 * std::sqrt(relit.LogVariance()));
}

TEST(RelitPixels, NothingStatedIsLeftAlone) {
  RelitPixels relit(kSeed);
  relit.Start(100, 0);
  EXPECT_TRUE(relit.Choose(std::vector<float>(100, 0.0f), std::vector<float>(100, 0.0f)).empty());
  EXPECT_TRUE(relit.Choose({}, {}).empty());
  EXPECT_EQ(relit.Scale(), 1);
  EXPECT_EQ(relit.LogVariance(), 0);
}

}  // namespace
}  // namespace luxfield::render
