#include "reconstruct/merge_exposures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "lightfield/measurements.h"

namespace luxfield::reconstruct {
namespace {

// A sample's share of the model that is the same for every pixel.
struct Scale {
  double k;              // DN per electron per second of X
  double dark_dn;        // expected dark signal without black level
  double dark_variance;  // of the subtracted dark value, DN^2
};

struct Sample {
  double k;
  double signal;          // y - d, DN
  double dark;            // black level and dark signal subtracted, DN
  double other_variance;  // all but the light's shot noise, DN^2
};

struct Estimate {
  double value = 0, variance = 0, count = 0;
};

double Variance(const Sample& sample, double gain, double x) {
  return gain * sample.k * std::max(x, 0.0) + sample.other_variance;
}

Estimate PoissonEstimate(std::span<const Sample> samples, double gain) {
  double signal = 0, k = 0, squares = 0, variance = 0;
  for (const Sample& sample : samples) {
    signal += sample.signal;
    k += sample.k;
    squares += sample.k * sample.k;
  }
  const double x = signal / k;
  for (const Sample& sample : samples) variance += Variance(sample, gain, x);
  return {x, variance / (k * k), k * k / squares};
}

Estimate InverseVarianceEstimate(std::span<const Sample> samples, double gain, int max_iterations) {
  Estimate estimate = PoissonEstimate(samples, gain);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    double numerator = 0, weights = 0, squares = 0;
    for (const Sample& sample : samples) {
      const double weight = sample.k * sample.k / Variance(sample, gain, estimate.value);
      numerator += weight * sample.signal / sample.k;
      weights += weight;
      squares += weight * weight;
    }
    const Estimate next{numerator / weights, 1 / weights, weights * weights / squares};
    const bool converged = std::abs(next.value - estimate.value) <= 1e-9 * std::sqrt(next.variance);
    estimate = next;
    if (converged) break;
  }
  return estimate;
}

// Pixels of one frame that clip, and their neighbours.
std::vector<std::uint8_t> ClippedAndNeighbours(const core::RawFrame& frame, double saturation_dn) {
  const int width = frame.width, height = frame.height;
  std::vector<std::uint8_t> result(frame.size(), 0);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const double y = frame.at(static_cast<std::size_t>(row) * width + column);
      if (std::isfinite(y) && y < saturation_dn) continue;
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, width - 1); ++c)
          result[static_cast<std::size_t>(r) * width + c] = 1;
    }
  return result;
}

void Check(const SensorModel& sensor, std::span<const Exposure> exposures) {
  if (exposures.empty())
    throw InputError("an exposure bracket without a frame cannot be merged; retake the position");
  const std::size_t pixels = static_cast<std::size_t>(sensor.width) * sensor.height;
  for (const Exposure& exposure : exposures) {
    if (exposure.frame->width != sensor.width || exposure.frame->height != sensor.height ||
        (exposure.dark && exposure.dark->mean_dn.size() != pixels))
      throw InputError(
          fmt::format("a frame or dark frame of {} x {} pixels does not fit the sensor of {} x {}; "
                      "session.json is of another camera",
                      exposure.frame->width, exposure.frame->height, sensor.width, sensor.height));
    if (!(exposure.exposure_s > 0 && exposure.attenuation > 0 && exposure.lamp_factor > 0))
      throw InputError(
          fmt::format("exposure {} s, attenuation {} and lamp factor {} must be above 0; the "
                      "session's journal is wrong",
                      exposure.exposure_s, exposure.attenuation, exposure.lamp_factor));
  }
}

}  // namespace

DarkFrame AverageDarks(std::span<const core::RawFrame> frames, double exposure_s) {
  if (frames.empty()) throw InputError("no dark frame to average");
  DarkFrame dark{exposure_s, static_cast<int>(frames.size()), {}};
  std::vector<double> sum(frames[0].size(), 0.0);
  for (const core::RawFrame& frame : frames) {
    if (frame.width != frames[0].width || frame.height != frames[0].height)
      throw InputError(
          fmt::format("dark frames of {} s have different sizes; retake them", exposure_s));
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += frame.at(p);
  }
  for (const double value : sum) dark.mean_dn.push_back(static_cast<float>(value / dark.count));
  return dark;
}

MergedFrame MergeExposures(const SensorModel& sensor, std::span<const Exposure> exposures,
                           const MergeOptions& options) {
  Check(sensor, exposures);
  const double gain = sensor.gain_dn_per_e;
  const double read_variance =
      sensor.read_noise_dn * sensor.read_noise_dn + sensor.quantisation_variance_dn2();

  // Longest effective exposure first.
  std::vector<Exposure> sorted(exposures.begin(), exposures.end());
  const auto strength = [](const Exposure& e) {
    return e.exposure_s * e.attenuation * e.lamp_factor;
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Exposure& a, const Exposure& b) { return strength(a) > strength(b); });
  std::vector<Scale> scales;
  std::vector<std::vector<std::uint8_t>> clipped(sorted.size());
  for (const Exposure& exposure : sorted) {
    const double dark_dn = gain * sensor.dark_current_e_per_s * exposure.exposure_s;
    scales.push_back(
        {gain * strength(exposure), dark_dn,
         exposure.dark ? (gain * dark_dn + read_variance) / exposure.dark->count : 0.0});
  }
  core::ParallelFor(sorted.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      clipped[n] = ClippedAndNeighbours(*sorted[n].frame, sensor.saturation_dn);
  });

  MergedFrame merged;
  merged.width = sensor.width;
  merged.height = sensor.height;
  const std::size_t pixels = static_cast<std::size_t>(sensor.width) * sensor.height;
  merged.rate_e_per_s.assign(pixels, 0);
  merged.sigma_e_per_s.assign(pixels, 0);
  merged.count.assign(pixels, 0);
  merged.mask.assign(pixels, 0);
  for (const auto& [row, column] : sensor.defects)
    merged.mask[static_cast<std::size_t>(row) * sensor.width + column] = lightfield::kDefect;

  core::ParallelFor(pixels, 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<Sample> samples;
    for (std::size_t p = begin; p < end; ++p) {
      if (merged.mask[p] & lightfield::kDefect) continue;
      samples.clear();
      for (std::size_t n = 0; n < sorted.size(); ++n) {
        if (clipped[n][p]) continue;
        const Scale& scale = scales[n];
        double dark = sensor.black_dn + scale.dark_dn, expected = scale.dark_dn;
        if (sorted[n].dark) {
          dark = sorted[n].dark->mean_dn[p];
          // A warm pixel's shot noise; within 4 standard deviations the model's mean is the better
          // guess.
          expected =
              std::max(expected, dark - sensor.black_dn - 4 * std::sqrt(scale.dark_variance));
        }
        samples.push_back({scale.k, sorted[n].frame->at(p) - dark, dark,
                           gain * expected + read_variance + scale.dark_variance});
      }
      Estimate estimate;
      std::span<const Sample> valid(samples);
      for (; !valid.empty(); valid = valid.subspan(1)) {
        estimate = options.estimator == Estimator::kPoisson
                       ? PoissonEstimate(valid, gain)
                       : InverseVarianceEstimate(valid, gain, options.max_iterations);
        const Sample& longest = valid.front();
        const double predicted = longest.dark + longest.k * estimate.value;
        if (predicted +
                options.saturation_margin * std::sqrt(Variance(longest, gain, estimate.value)) <
            sensor.saturation_dn)
          break;
      }
      if (valid.empty()) {
        merged.mask[p] |= lightfield::kSaturated;
        continue;
      }
      const double prnu = sensor.prnu * estimate.value;
      merged.rate_e_per_s[p] = static_cast<float>(estimate.value);
      merged.sigma_e_per_s[p] = static_cast<float>(std::sqrt(estimate.variance + prnu * prnu));
      merged.count[p] = static_cast<float>(estimate.count);
      if (estimate.value < options.too_dark_sigmas * std::sqrt(estimate.variance))
        merged.mask[p] |= lightfield::kTooDark;
    }
  });
  return merged;
}

}  // namespace luxfield::reconstruct
