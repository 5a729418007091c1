// An exposure bracket -> electrons per second with their standard deviation (docs/theory.md 3,
// "Exposure bracket"; docs/lab.md, "Exposure brackets").
//
// Sample i of a pixel: x_i = (y_i - d_i) / k_i with k_i = gain * t_i * a_i * l_i (l: the lamp's
// level) and d_i the dark signal, black level included: from averaged dark frames of the same
// exposure time, else from the sensor model.
//
//   X = sum (y_i - d_i) / sum k_i        Poisson estimator (Hanji et al. 2020)
//   X = sum w_i x_i / sum w_i            iterated inverse variance (Granados et al. 2010)
//   w_i = 1 / var(x_i)                   at the merged X
//   var(x_i) = [gain (k_i max(X, 0) + dark signal) + read^2 + quantisation + var(d_i)] / k_i^2
//   sigma^2 = var of the weighted mean + (prnu X)^2
//
// PRNU is common to all exposures: it stays out of w_i.
//
// The weights come from the merged estimate, never from a sample's own noisy value, which would be
// biased low; X solves sum k_i (y_i - d_i - k_i X) / var_i(X) = 0, whose bias is of second order in
// 1 / electrons. So does the decision that a sample is too near saturation: starting with the
// longest exposure, a sample leaves while the merged X (itself included) predicts a value within
// `saturation_margin` standard deviations of clipping. The efficient estimate is uncorrelated with
// what the shorter exposures add to it, hence deciding by it leaves no bias.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "luxfield/lightfield/measurements.h"
#include "luxfield/rig/sensor_model.h"
#include "luxfield/session/raw_frame.h"

namespace luxfield::reconstruct {

// The mean of `count` dark frames of one exposure time, black level included.
struct DarkFrame {
  double exposure_s = 0;
  int count = 0;
  std::vector<float> mean_dn;  // per pixel
};

// Adds up dark frames, those given together in one pass over the sums: 32-bit ones of whole numbers,
// exact, else double.
class DarkSum {
 public:
  explicit DarkSum(double exposure_s);
  // Throws InputError for a frame of another size or kind, and for more than 65536 of them.
  void Add(std::span<const session::RawFrame> frames);
  void Add(const session::RawFrame& frame) { Add(std::span(&frame, 1)); }
  DarkFrame Mean() const;  // throws InputError for no frames

 private:
  void Require(const session::RawFrame& frame) const;

  double exposure_s_;
  int width_ = 0, height_ = 0, count_ = 0;
  std::vector<std::uint32_t> whole_dn_;  // of cameras that count in whole numbers
  std::vector<double> sum_dn_;           // of others
};

// The same of frames at hand.
DarkFrame AverageDarks(std::span<const session::RawFrame> frames, double exposure_s);

struct Exposure {
  const session::RawFrame* frame = nullptr;
  double exposure_s = 0;
  double attenuation = 1;           // of an ND filter
  double lamp_factor = 1;           // lamp level during this exposure over its reference level
  const DarkFrame* dark = nullptr;  // of the same exposure time; null: the sensor model's
};

enum class Estimator { kPoisson, kInverseVariance };

struct MergeOptions {
  Estimator estimator = Estimator::kInverseVariance;
  double saturation_margin = 5;  // standard deviations that a sample's predicted value must keep
                                 // from clipping, at saturation and at 0 DN
  // Newton steps of the inverse variance, at least 1. It stops earlier, where the next one would be
  // below 1e-4 sigma and the weights have changed by less than 1e-3.
  int max_iterations = 20;
};

struct MergedFrame {
  int width = 0, height = 0;
  std::vector<float> rate_e_per_s;  // estimates: under kTooDark for further sums only
  std::vector<float> sigma_e_per_s;
  std::vector<float> count;         // effective number of exposures, (sum w)^2 / sum w^2
  std::vector<std::uint32_t> mask;  // lightfield::MeasurementFlag: kSaturated, kBelowBlack,
                                    // kTooDark, kDefect; unknown pixels hold 0

  // What may be reported of a pixel; none where it is unknown or too dark.
  std::optional<float> Number(std::size_t pixel) const {
    if (mask[pixel] & (lightfield::kUnknownMask | lightfield::kTooDark)) return {};
    return rate_e_per_s[pixel];
  }
};

// Samples that clip (y >= saturation_dn, or not finite), their neighbours and what their overflow
// reaches (excluded_samples.h) have weight zero. So have, of cameras that count in whole numbers,
// samples that X predicts within the margin of 0 DN, where the ADC clips what read noise takes
// below, and samples with less than 0.5 DN of noise beside a longer one: rounding is noise only
// where noise dithers it. Where all darks are the sensor model's, such samples enter after all, by
// the exact moments of their codes (dark_codes.h).
//
// A pixel whose X is less than lightfield::kDetectionSigmas of its standard deviations (without
// PRNU) above 0 is kTooDark. A pixel left without samples is kSaturated or, if a sample was too
// near 0 DN, kBelowBlack; so is one whose X is negative by twice the margin: such a black level is
// wrong. Arithmetic in float32 on residuals y - d - k X; rounding and stopping change X by less
// than 1e-4 sigma + 1e-6 X and sigma by less than 1e-3 of itself. Vectorised and parallel over
// pixels; the result doesn't depend on the threads. Every sample is read twice (2 bytes, and once 4
// of its dark frame's mean), 16 bytes a pixel are written, and two bits a pixel of every frame that
// clips. Throws InputError if a frame or dark frame does not have the sensor's size, or an
// exposure, attenuation or lamp factor is not above 0.
MergedFrame MergeExposures(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
                           const MergeOptions& options = {});
// The same into planes that are used again.
void MergeExposures(const rig::SensorModel& sensor, std::span<const Exposure> exposures,
                    const MergeOptions& options, MergedFrame* merged);

}  // namespace luxfield::reconstruct
