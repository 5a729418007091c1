#include "luxfield/render/accuracy/light_samples.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace luxfield::render {
namespace {

constexpr double kMaxSamples = 1 << 20;
constexpr double kStep = 1.02;        // between numbers of samples that are compared
constexpr double kLeast_s = 1e-15;    // of a sample; clocks may say that it costs nothing
constexpr double kSmallest = 1e-100;  // price of variance
constexpr int kHalvings = 100;

// Numbers of samples of a light, and what they leave.
struct Choices {
  std::vector<double> samples, variances;
  double sample_s;

  explicit Choices(const LightLaw& light) : sample_s(std::max(kLeast_s, light.sample_s)) {
    for (double n = light.least; n < kMaxSamples; n = std::max(n + 1, std::round(n * kStep))) {
      samples.push_back(n);
      variances.push_back(light.Variance(n));
    }
    samples.push_back(std::max(light.least, kMaxSamples));
    variances.push_back(light.Variance(samples.back()));
  }
  // Where a unit of variance is worth `price` seconds.
  double Best(double price) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < samples.size(); ++i)
      if (samples[i] * sample_s + price * variances[i] <
          samples[best] * sample_s + price * variances[best])
        best = i;
    return samples[best];
  }
};

// The samples at the highest price that is not `enough`, and at the next one that is.
struct Around {
  std::vector<double> below, above;
};
Around AroundPrice(std::span<const LightLaw> lights,
                   const std::function<bool(const std::vector<double>&)>& enough) {
  const std::vector<Choices> choices(lights.begin(), lights.end());
  const auto at = [&](double log_price) {
    std::vector<double> samples;
    for (const Choices& light : choices) samples.push_back(light.Best(std::exp(log_price)));
    return samples;
  };
  double low = std::log(kSmallest), high = -low;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (enough(at(middle)) ? high : low) = middle;
  }
  return {at(low), at(high)};
}

}  // namespace

double VarianceOf(std::span<const LightLaw> lights, std::span<const double> samples) {
  double sum = 0;
  for (std::size_t l = 0; l < lights.size(); ++l) sum += lights[l].Variance(samples[l]);
  return sum;
}

double SecondsOf(std::span<const LightLaw> lights, std::span<const double> samples) {
  double sum = 0;
  for (std::size_t l = 0; l < lights.size(); ++l) sum += lights[l].Seconds(samples[l]);
  return sum;
}

std::vector<double> SamplesForVariance(std::span<const LightLaw> lights, double variance) {
  return AroundPrice(lights,
                     [&](const std::vector<double>& samples) {
                       return VarianceOf(lights, samples) <= variance;
                     })
      .above;
}

std::vector<double> SamplesForSeconds(std::span<const LightLaw> lights, double seconds) {
  return AroundPrice(lights,
                     [&](const std::vector<double>& samples) {
                       return SecondsOf(lights, samples) > seconds;
                     })
      .below;
}

}  // namespace luxfield::render
