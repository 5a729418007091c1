#include "luxfield/bench/strategy_variance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "luxfield/core/colour.h"
#include "luxfield/core/measures.h"

namespace luxfield::bench {
namespace {

// Variance over the pictures first, first + step, ..., pixel by pixel.
std::vector<double> Variances(const std::vector<core::Image>& pictures, int first, int step) {
  std::vector<double> mean(pictures[0].data.size(), 0.0), squares = mean;
  int count = 0;
  for (std::size_t seed = first; seed < pictures.size(); seed += step) {
    ++count;
    for (std::size_t k = 0; k < mean.size(); ++k) {
      const double difference = pictures[seed].data[k] - mean[k];
      mean[k] += difference / count;
      squares[k] += difference * (pictures[seed].data[k] - mean[k]);
    }
  }
  for (double& value : squares) value /= count - 1;
  return squares;
}

// Mean over 3 x 3 pixels of those that hit something, of values in the order of scene.hit().
std::vector<double> Smoothed(const LightsApart& scene, const std::vector<double>& values) {
  const int width = scene.width(), height = scene.height();
  std::vector<int> place(static_cast<std::size_t>(width) * height, -1);
  for (std::size_t k = 0; k < scene.hit().size(); ++k) place[scene.hit()[k]] = static_cast<int>(k);
  std::vector<double> smooth;
  for (const std::size_t pixel : scene.hit()) {
    const int row = static_cast<int>(pixel) / width, column = static_cast<int>(pixel) % width;
    double sum = 0;
    int count = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
        if (const int k = place[r * width + c]; k >= 0) {
          sum += values[k];
          ++count;
        }
    smooth.push_back(sum / count);
  }
  return smooth;
}

}  // namespace

std::vector<double> VarianceScales(const core::Image& reference) {
  const core::Image luminance = core::LuminanceImage(reference);
  const auto count = static_cast<double>(luminance.data.size());
  const double mean = std::accumulate(luminance.data.begin(), luminance.data.end(), 0.0) / count;
  std::vector<double> scales;
  for (const float y : luminance.data)
    scales.push_back(1 / (double{y} * y + 1e-4 * mean * mean) / count);
  return scales;
}

Runs RunSeeds(LightsApart& scene, const StrategySetting& setting, std::uint64_t first_seed,
              int seeds, const core::Image& reference, std::span<const core::Image> light_shares) {
  Runs runs;
  runs.part_luminance.resize(scene.names().size());
  for (int seed = 0; seed < seeds; ++seed) {
    const auto picture = scene.Light(setting, first_seed + seed, light_shares);
    runs.mean_lab += core::Compare(picture.radiance, reference).mean_lab / seeds;
    if (seed == 0 || picture.core_s < runs.core_s) runs.core_s = picture.core_s;
    if (seed == 0 || picture.wall_s < runs.wall_s) runs.wall_s = picture.wall_s;
    runs.luminance.push_back(core::LuminanceImage(picture.radiance));
    for (std::size_t light = 0; light < picture.parts.size(); ++light)
      runs.part_luminance[light].push_back(core::LuminanceImage(picture.parts[light]));
  }
  return runs;
}

Estimate RelativeVariance(const Runs& runs, const std::vector<double>& scales) {
  const auto seeds = static_cast<double>(runs.luminance.size());
  std::vector<double> mean(scales.size(), 0.0);
  for (const auto& picture : runs.luminance)
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += picture.data[k] / seeds;
  Estimate estimate;
  double squares = 0;
  for (const auto& picture : runs.luminance) {
    double sum = 0;
    for (std::size_t k = 0; k < mean.size(); ++k)
      sum += scales[k] * std::pow(picture.data[k] - mean[k], 2) * seeds / (seeds - 1);
    estimate.of_seeds.push_back(sum);
    estimate.value += sum / seeds;
    squares += sum * sum / seeds;
  }
  estimate.standard_error =
      std::sqrt(std::max(0.0, squares - estimate.value * estimate.value) / (seeds - 1));
  return estimate;
}

Estimate RelativeDifference(const Estimate& a, const Estimate& b) {
  const auto seeds = static_cast<double>(a.of_seeds.size());
  const double ratio = b.value / a.value;
  Estimate difference;
  difference.value = ratio - 1;
  double squares = 0;
  for (std::size_t k = 0; k < a.of_seeds.size(); ++k) {
    // The ratio's change to first order.
    const double deviation = (b.of_seeds[k] - ratio * a.of_seeds[k]) / a.value;
    difference.of_seeds.push_back(difference.value + deviation);
    squares += deviation * deviation;
  }
  difference.standard_error = std::sqrt(squares / (seeds * (seeds - 1)));
  return difference;
}

double BestOfEachPixel(const LightsApart& scene, const std::vector<Runs>& choices,
                       const std::vector<double>& scales) {
  double sum = 0;
  for (std::size_t light = 0; light < scene.names().size(); ++light)
    for (const int chosen_on : {0, 1}) {
      std::vector<double> least(scales.size(), std::numeric_limits<double>::infinity()),
          judged(scales.size(), 0.0);
      for (const Runs& runs : choices) {
        const auto choose = Smoothed(scene, Variances(runs.part_luminance[light], chosen_on, 2)),
                   judge = Variances(runs.part_luminance[light], 1 - chosen_on, 2);
        for (std::size_t k = 0; k < scales.size(); ++k)
          if (choose[k] < least[k]) {
            least[k] = choose[k];
            judged[k] = judge[k];
          }
      }
      for (std::size_t k = 0; k < scales.size(); ++k) sum += scales[k] * judged[k] / 2;
    }
  return sum;
}

}  // namespace luxfield::bench
