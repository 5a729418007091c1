#include "luxfield/render/film/relit_pixels.h"

#include <algorithm>
#include <cmath>

namespace luxfield::render {
namespace {

constexpr double kShare = 0.125, kLeast = 256, kMost = 8192;  // of points: draws times runs
constexpr int kRuns = 2, kRunsOfSharedSets = 32;
constexpr double kDrawsOfSharedSets = 64;
constexpr double kEvenShare = 0.25;  // of p, the same for all pixels
constexpr double kWholeShare = 0.5;  // of the rest, where parts are wanted too
constexpr std::size_t kLeastDraws = 2;

// Streams of a seed.
constexpr std::uint64_t kDraws = 0x52656C6974ull, kSeeds = 0x416761696Eull;

double SumOf(std::span<const float> values) {
  double sum = 0;
  for (const float x : values) sum += x;
  return sum;
}

double SampleVariance(std::span<const double> values) {
  double mean = 0, squares = 0;
  for (const double x : values) mean += x / static_cast<double>(values.size());
  for (const double x : values) squares += (x - mean) * (x - mean);
  return squares / static_cast<double>(values.size() - 1);
}

// v_k / (m p_k) of each draw.
std::vector<double> WeightedVariances(std::span<const RelitPixels::Draw> draws,
                                      std::span<const std::vector<double>> luminance) {
  std::vector<double> weighted, of_draw(luminance.size());
  for (std::size_t k = 0; k < draws.size(); ++k) {
    for (std::size_t run = 0; run < luminance.size(); ++run) of_draw[run] = luminance[run][k];
    weighted.push_back(draws[k].weight * SampleVariance(of_draw));
  }
  return weighted;
}

}  // namespace

void RelitPixels::Start(std::size_t points, int shared_sets) {
  random_ = core::Random(seed_, kDraws);
  shared_sets_ = shared_sets;
  runs_ = shared_sets > 0 ? kRunsOfSharedSets : kRuns;
  const auto all = static_cast<double>(points);
  draws_per_point_ =
      (shared_sets > 0 ? kDrawsOfSharedSets : std::clamp(kShare * all, kLeast, kMost) / kRuns) /
      all;
  drawn_ = 0;
  stated_ = measured_ = measured_variance_ = 0;
}

std::uint64_t RelitPixels::Seed(int run) const {
  core::Random random(seed_, kSeeds, static_cast<std::uint32_t>(run));
  const std::uint64_t high = random();
  return high << 32 | random();
}

std::vector<RelitPixels::Draw> RelitPixels::Choose(std::span<const float> stated,
                                                   std::span<const float> guides,
                                                   std::span<const std::vector<float>> parts) {
  const double sum = SumOf(guides);
  std::vector<double> sums;
  for (const auto& part : parts) sums.push_back(SumOf(part));
  const auto noisy =
      static_cast<double>(std::count_if(sums.begin(), sums.end(), [](double s) { return s > 0; }));
  const double whole_share = noisy > 0 ? kWholeShare : 1;
  std::vector<Draw> draws;
  if (!(sum > 0)) return draws;
  stated_ += SumOf(stated);
  const auto pixels = static_cast<double>(stated.size());
  const auto count = std::max(kLeastDraws, static_cast<std::size_t>(draws_per_point_ * pixels));
  // Evenly over the cumulative probabilities (systematic sampling, Madow 1949).
  double below = 0;
  double next = random_.Uniform() / static_cast<double>(count);
  for (std::size_t pixel = 0; pixel < stated.size() && draws.size() < count; ++pixel) {
    double shown = whole_share * guides[pixel] / sum;
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (sums[k] > 0) shown += (1 - whole_share) / noisy * parts[k][pixel] / sums[k];
    const double p = kEvenShare / pixels + (1 - kEvenShare) * shown;
    below += p;
    for (; next < below && draws.size() < count; next += 1 / static_cast<double>(count))
      draws.push_back({pixel, 1 / (static_cast<double>(count) * p)});
  }
  drawn_ += draws.size();
  return draws;
}

void RelitPixels::Add(std::span<const Draw> draws, std::span<const std::vector<double>> luminance) {
  const std::vector<double> weighted = WeightedVariances(draws, luminance);
  for (const double v : weighted) measured_ += v;
  if (weighted.size() > 1)
    measured_variance_ += SampleVariance(weighted) * static_cast<double>(weighted.size());
}

double RelitPixels::Variance(std::span<const Draw> draws,
                             std::span<const std::vector<double>> luminance) {
  double sum = 0;
  for (const double v : WeightedVariances(draws, luminance)) sum += v;
  return sum;
}

double RelitPixels::LogVariance() const {
  if (!(measured_ > 0)) return 0;
  return measured_variance_ / (measured_ * measured_) +
         (shared_sets_ > 0 ? 2.0 / ((runs_ - 1.0) * shared_sets_) : 0);
}

}  // namespace luxfield::render
