#include "luxfield/render/accuracy/further_round.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "luxfield/core/measures.h"
#include "luxfield/render/film/neighbours.h"

namespace luxfield::render {
namespace {

constexpr double kLuminanceShare = 0.25;  // as of sample_density.cc
constexpr double kMostOverMean = 256;     // of s
constexpr double kHardlyMore = 0.25;      // of what a pixel has: no further round is worth it
constexpr double kBinsPerOctave = 4;      // of s
constexpr double kLargestDensity = 512;   // RenderOptions::Validate
constexpr int kHalvings = 60;
constexpr double kLogRange = 46;  // of the price: e^46 either way

// Of the pixels next to this one that were lit; further ones where none was.
double MeanBeside(const core::Image& values, const core::Image& taken, int row, int column) {
  const double next = MeanAround(values, taken, row, column, {.reach = 1, .itself = false});
  return next > 0 ? next : MeanAround(values, taken, row, column, {.reach = 2, .itself = false});
}

// Standard deviations of one sample.
struct Noise {
  std::vector<std::size_t> pixels;
  std::vector<double> deviations;  // of these
};

Noise NoiseBeside(const Frame& frame, const core::Image& taken) {
  core::Image of_one = frame.variance, squares = core::LuminanceImage(frame.radiance);
  for (std::size_t i = 0; i < of_one.data.size(); ++i) {
    of_one.data[i] *= taken.data[i];
    squares.data[i] *= squares.data[i];
  }
  Noise noise;
  std::vector<double> variances, luminances;
  double all_variances = 0, all_luminances = 0;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      if (!(frame.coverage.at(0, row, column) > 0)) continue;
      noise.pixels.push_back(static_cast<std::size_t>(row) * frame.width + column);
      variances.push_back(MeanBeside(of_one, taken, row, column));
      luminances.push_back(MeanBeside(squares, taken, row, column));
      all_variances += variances.back();
      all_luminances += luminances.back();
    }
  const double per_luminance =
      all_luminances > 0 ? kLuminanceShare * all_variances / all_luminances : 0;
  double sum = 0;
  for (std::size_t k = 0; k < variances.size(); ++k) {
    noise.deviations.push_back(
        std::sqrt((1 - kLuminanceShare) * variances[k] + per_luminance * luminances[k]));
    sum += noise.deviations.back();
  }
  for (double& s : noise.deviations)
    s = std::min(s, kMostOverMean * sum / static_cast<double>(noise.deviations.size()));
  return noise;
}

// Pixels that are alike.
struct Kind {
  int bin = 0;      // of the logarithm of s
  float taken = 0;  // samples
  bool operator<(const Kind& other) const {
    return std::pair(bin, taken) < std::pair(other.bin, other.taken);
  }
};

Kind KindOf(double deviation, float taken) {
  return {static_cast<int>(std::floor(kBinsPerOctave * std::log2(std::max(deviation, 1e-30)))),
          taken};
}

class Planner {
 public:
  Planner(const Frame& frame, const core::Image& taken, const VarianceLaw& law,
          const FurtherAim& aim)
      : noise_(NoiseBeside(frame, taken)), taken_(taken), law_(law), aim_(aim) {
    double samples = 0, lit = 0;
    for (const float n : taken.data) {
      samples += n;
      lit += n > 0;
    }
    usual_ = lit > 0 ? samples / lit : 1;
    for (std::size_t k = 0; k < noise_.pixels.size(); ++k) {
      const double s = noise_.deviations[k];
      Pixels& pixels = kinds_[KindOf(s, taken.data[noise_.pixels[k]])];
      ++pixels.count;
      pixels.variance += s * s;
    }
  }

  FurtherRound Plan() const {
    double low = -kLogRange, high = kLogRange;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (VarianceAt(std::exp(middle)) <= aim_.variance ? high : low) = middle;
    }
    return RoundAt(std::exp(high));
  }

 private:
  struct Pixels {
    double count = 0, variance = 0;  // sum of s^2
    double Deviation() const { return std::sqrt(variance / count); }
  };

  // Further samples of a pixel, where s is worth `price` of them.
  double Further(double price, double deviation, double taken) const {
    double more = std::min(price * deviation, aim_.most) - taken;
    if (taken < aim_.least)
      more = std::max(more, aim_.least - taken);
    else if (more < kHardlyMore * taken)
      return 0;
    return aim_.unit * std::exp2(std::max(0.0, std::round(std::log2(more / aim_.unit))));
  }

  double VarianceAt(double price) const {
    double sum = 0;
    for (const auto& [kind, pixels] : kinds_) {
      const double n = kind.taken, m = Further(price, pixels.Deviation(), n);
      const double measured_at = n > 0 ? n : usual_, expected = law_.Of(measured_at);
      // Over that of as many samples as `measured_at` tells of.
      const double falls = m > 0 && expected > 0 ? law_.Of(m) * m / (expected * measured_at) : 1;
      sum += pixels.variance * (n + m * falls) / ((n + m) * (n + m));
    }
    return sum / static_cast<double>(taken_.data.size());
  }

  FurtherRound RoundAt(double price) const {
    FurtherRound round;
    round.variance = VarianceAt(price);
    round.density = core::Image(taken_.width, taken_.height, 1);
    double largest = aim_.unit;
    for (std::size_t k = 0; k < noise_.pixels.size(); ++k) {
      const std::size_t pixel = noise_.pixels[k];
      const float taken = taken_.data[pixel];
      const double more =
          Further(price, kinds_.at(KindOf(noise_.deviations[k], taken)).Deviation(), taken);
      round.density.data[pixel] = static_cast<float>(more);
      round.samples += more;
      round.lit += more > 0;
      largest = std::max(largest, more);
    }
    round.samples /= static_cast<double>(noise_.pixels.size());
    round.lit /= static_cast<double>(noise_.pixels.size());
    round.samples_per_pixel = aim_.unit;
    while (largest / round.samples_per_pixel > kLargestDensity) round.samples_per_pixel *= 2;
    for (float& density : round.density.data)
      density /= static_cast<float>(round.samples_per_pixel);
    return round;
  }

  Noise noise_;
  const core::Image& taken_;
  const VarianceLaw& law_;
  FurtherAim aim_;
  double usual_ = 1;  // samples of pixels that have any
  std::map<Kind, Pixels> kinds_;
};

}  // namespace

FurtherRound PlanFurtherRound(const Frame& frame, const core::Image& taken, const VarianceLaw& law,
                              const FurtherAim& aim) {
  return Planner(frame, taken, law, aim).Plan();
}

core::Image SamplesOf(const FurtherRound& round) {
  core::Image samples = round.density;
  for (float& n : samples.data) n *= static_cast<float>(round.samples_per_pixel);
  return samples;
}

}  // namespace luxfield::render
