// A stack of pictures and the camera's response -> radiance with its standard deviation.
//
//   x_j = I(z_j) / t_j,   X = sum w_j x_j / sum w_j,   w_j = 1 / v_j,   var(X) = X^2 / sum w_j
//
// v_j is the relative variance of one pixel's exposure (ResponseCurve::noise) at the code that X
// predicts, never at the sample's own, which would bias (THEORY.md 3); iterated. To it comes the
// curve's own standard error, common to all pixels of a code: sigma^2 = var(X) + (X sum w_j s_j /
// sum w_j)^2.
//
// Which samples count is decided by X as well: from the longest exposure on one leaves while X
// predicts a code within `end_margin` standard deviations of the curve's upper end, then from the
// shortest on while of its lower end. X is then the efficient estimate, uncorrelated with what the
// sample adds to it, hence the choice leaves no bias. Saturated pixels and their neighbours never
// count. What is left without samples is flagged and holds no number.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "reconstruct/exposure_ratios.h"
#include "reconstruct/picture_stack.h"
#include "reconstruct/response_curve.h"

namespace luxfield::reconstruct {

// A sample that counts.
struct StackSample {
  int exposure = 0;
  double radiance = 0;           // x_j
  double relative_variance = 0;  // v_j
};

struct PixelRadiance {
  double value = 0, sigma = 0;
  double count = 0;        // effective number of exposures, (sum w)^2 / sum w^2
  std::uint32_t mask = 0;  // lightfield::MeasurementFlag: kSaturated or kTooDark, then no value
};

// One channel's merger: tables of the curve by code and of its noise by exposure.
class ResponseMerger {
 public:
  ResponseMerger(const ResponseCurve& curve, int bits, double end_margin = 4);

  // `codes` of one pixel, shortest exposure first; `usable[j]` 0: next to a saturated one. After
  // it samples() holds those that counted.
  PixelRadiance Merge(std::span<const std::uint16_t> codes, std::span<const std::uint8_t> usable,
                      std::span<const double> exposures_s);
  std::span<const StackSample> samples() const { return {first_, last_}; }

 private:
  struct Prediction {
    double relative_variance, curve_sigma;
  };
  Prediction At(double log_exposure) const;
  double Estimate(double radiance);

  std::vector<double> exposure_;       // I by code
  std::vector<Prediction> predicted_;  // by ln I, kSteps from lowest_ on
  double lowest_ = 0, step_ = 0;
  double low_ = 0, high_ = 0;  // ln I of the curve's ends
  double saturation_code_, end_margin_;
  std::vector<StackSample> all_;
  std::vector<double> log_t_;  // of all_
  StackSample *first_ = nullptr, *last_ = nullptr;
};

struct MergedPicture {
  core::Image radiance;  // exposures of the reference code per second; 0 where flagged
  core::Image sigma, count;
  std::vector<std::uint32_t> mask;  // planes as radiance
  std::vector<double> exposures_s;  // as used
};

// `curves` one per channel. Throws InputError where they are not as many as the stack's channels.
MergedPicture MergeStack(const PictureStack& stack, std::span<const ResponseCurve> curves);

// The pictures' true over their nominal exposures, by some 20000 pixels a channel, from the merge
// with the nominal ones; the longest keeps its own. In the pictures that the response was
// calibrated from, the curve has taken errors of the exposures in and hides most of them.
ExposureRatios::Result EstimateExposures(const PictureStack& stack,
                                         std::span<const ResponseCurve> curves);

// docs/formats/merged-picture.md.
void WriteMergedPicture(const std::filesystem::path& path, const MergedPicture& merged,
                        const std::map<std::string, std::string>& provenance);

}  // namespace luxfield::reconstruct
