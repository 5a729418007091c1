// An exposure bracket -> electrons per second with their standard deviation (THEORY.md 3;
// LAB.md 4.2).
//
// Sample i of a pixel: x_i = (y_i - d_i) / k_i with k_i = gain * t_i * a_i * l_i (l: the lamp's
// level) and d_i the dark signal, black level included: from averaged dark frames of the same
// exposure time, else from the sensor model.
//
//   Poisson estimator (Hanji et al. 2020)             X = sum (y_i - d_i) / sum k_i
//   Iterated inverse variance (Granados et al. 2010)  X = sum w_i x_i / sum w_i,  w_i = 1 /
//   var(x_i) at the merged X var(x_i) = [gain (k_i max(X, 0) + dark signal) + read^2 + quantisation
//   + var(d_i)] / k_i^2 sigma^2 = var of the weighted mean + (prnu X)^2          (PRNU is common to
//   all exposures: it stays out of w_i)
//
// The weights come from the merged estimate, never from a sample's own noisy value, which would be
// biased low. So does the decision that a sample is too near saturation: starting with the longest
// exposure, a sample leaves while the merged X (itself included) predicts a value within
// `saturation_margin` standard deviations of clipping. The efficient estimate is uncorrelated with
// what the shorter exposures add to it, hence deciding by it leaves no bias.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/raw_frame.h"
#include "reconstruct/noise_model.h"

namespace luxfield::reconstruct {

// The mean of `count` dark frames of one exposure time, black level included.
struct DarkFrame {
  double exposure_s = 0;
  int count = 0;
  std::vector<float> mean_dn;  // per pixel
};

// Throws InputError for no frames or frames of different sizes.
DarkFrame AverageDarks(std::span<const core::RawFrame> frames, double exposure_s);

struct Exposure {
  const core::RawFrame* frame = nullptr;
  double exposure_s = 0;
  double attenuation = 1;           // of an ND filter
  double lamp_factor = 1;           // lamp level during this exposure over its reference level
  const DarkFrame* dark = nullptr;  // of the same exposure time; null: the sensor model's
};

enum class Estimator { kPoisson, kInverseVariance };

struct MergeOptions {
  Estimator estimator = Estimator::kInverseVariance;
  double saturation_margin =
      5;  // standard deviations below clipping that a sample's predicted value must keep
  double too_dark_sigmas =
      1;  // X below so many of its own standard deviations (without PRNU) is flagged kTooDark
  int max_iterations =
      20;  // of the inverse variance; it stops earlier when X changes by less than 1e-9 of sigma
};

struct MergedFrame {
  int width = 0, height = 0;
  std::vector<float> rate_e_per_s;  // negative values kept
  std::vector<float> sigma_e_per_s;
  std::vector<float> count;  // effective number of exposures, (sum w)^2 / sum w^2
  std::vector<std::uint32_t>
      mask;  // lightfield::MeasurementFlag: kSaturated, kTooDark, kDefect; unknown pixels hold 0
};

// Samples that clip (y >= saturation_dn, or not finite) are dilated by one pixel for blooming and
// have weight zero; a pixel left without samples is kSaturated. Arithmetic per pixel in double;
// parallel over pixels. Throws InputError if a frame or dark frame does not have the sensor's size,
// or an exposure, attenuation or lamp factor is not above 0.
MergedFrame MergeExposures(const SensorModel& sensor, std::span<const Exposure> exposures,
                           const MergeOptions& options = {});

}  // namespace luxfield::reconstruct
