#include "luxfield/reconstruct/solve/flux_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::reconstruct {
namespace {

// The definition: values sorted, and flux summed along them. Fluxes are integers, so that sums in
// any order are the same.
RayWindow SortedWindow(std::vector<std::pair<double, double>> values, double outside) {
  std::sort(values.begin(), values.end());
  double total = 0, sum = 0;
  for (const auto& [x, flux] : values) total += flux;
  RayWindow window;
  bool below = true;
  for (const auto& [x, flux] : values) {
    if (flux == 0) continue;
    sum += flux;
    if (below && sum >= outside * total) {
      window.low = x;
      below = false;
    }
    window.high = x;
    if (sum >= (1 - outside) * total) break;
  }
  return window;
}

TEST(FluxWindow, IsThatOfTheSortedValues) {
  core::Random random(25, 26);
  const std::array<std::function<double()>, 4> draws{
      [&] { return random.Uniform(); },
      [&] { return std::pow(random.Uniform() - 0.5, -5); },       // far outliers on both sides
      [&] { return std::floor(3 * random.Uniform()); },           // few values
      [&] { return std::exp(200 * (random.Uniform() - 0.5)); }};  // over many magnitudes
  for (std::size_t draw = 0; draw < draws.size(); ++draw)
    for (const int count : {1, 2, 1000, 50000}) {
      std::vector<std::pair<double, double>> values;
      values.reserve(count);
      for (int n = 0; n < count; ++n)
        values.emplace_back(draws[draw](), std::floor(5 * random.Uniform()));
      values.back().second = 1;
      for (const double outside : {0.0, 0.00125, 0.02, 0.25}) {
        FluxWindow window(outside);
        do {
          for (const auto& [x, flux] : values) window.Add(x, flux);
        } while (window.EndPass());
        const RayWindow sorted = SortedWindow(values, outside);
        EXPECT_EQ(window.window().low, sorted.low) << draw << " " << count << " " << outside;
        EXPECT_EQ(window.window().high, sorted.high) << draw << " " << count << " " << outside;
      }
    }
}

}  // namespace
}  // namespace luxfield::reconstruct
