#include "luxfield/render/accuracy/sample_density.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "luxfield/core/measures.h"
#include "luxfield/render/film/neighbours.h"

namespace luxfield::render {
namespace {

constexpr double kMost = 256;
constexpr double kLuminanceShare = 0.25;

double SumOf(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum;
}

}  // namespace

SampleDensity DensityFrom(const Frame& frame, double least) {
  core::Image luminance = core::LuminanceImage(frame.radiance), of_one = frame.variance;
  for (float& y : luminance.data) y *= y;
  for (std::size_t i = 0; i < of_one.data.size(); ++i) of_one.data[i] *= frame.samples.data[i];
  std::vector<double> variances, squares;
  std::vector<std::size_t> pixels;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      if (!(frame.coverage.at(0, row, column) > 0)) continue;
      pixels.push_back(static_cast<std::size_t>(row) * frame.width + column);
      variances.push_back(MeanAround(of_one, frame.coverage, row, column));
      squares.push_back(MeanAround(luminance, frame.coverage, row, column));
    }
  SampleDensity result;
  const double all_squares = SumOf(squares), all_variances = SumOf(variances);
  if (!(all_variances > 0 && all_squares > 0)) return result;

  std::vector<double> noise(pixels.size());
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise[i] = std::sqrt((1 - kLuminanceShare) * variances[i] +
                         kLuminanceShare * squares[i] * all_variances / all_squares);
  const double mean_noise = SumOf(noise) / static_cast<double>(noise.size());
  result.density = core::Image(frame.width, frame.height, 1);
  std::fill(result.density.data.begin(), result.density.data.end(), 1.0f);
  const double least_power = std::exp2(std::ceil(std::log2(least)));
  double samples = 0, left = 0, even = 0;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const double density = noise[i] > 0
                               ? std::clamp(std::exp2(std::round(std::log2(noise[i] / mean_noise))),
                                            least_power, kMost)
                               : least_power;
    result.density.data[pixels[i]] = static_cast<float>(density);
    samples += density;
    left += noise[i] * noise[i] / density;
    even += noise[i] * noise[i];
  }
  result.mean = samples / static_cast<double>(noise.size());
  result.variance = left / even;
  result.variance_of_one = all_variances / static_cast<double>(of_one.data.size());
  return result;
}

}  // namespace luxfield::render
