// A stack of pictures and the camera's response -> radiance with its standard deviation.
//
//   x_j = I(z_j) / t_j,   X = sum w_j x_j / sum w_j,   w_j = 1 / v_j,   var(X) = X^2 / sum w_j
//
// v_j is the relative variance of one pixel's exposure (ResponseCurve::noise) at the code that X
// predicts, never at the sample's own, which would bias (docs/theory.md 3); iterated. To it comes
// the curve's own standard error, common to all pixels of a code:
//
//   sigma^2 = s^2 var(X) + (X sum w_j s_j / sum w_j)^2,   s^2 = chi^2 / (n - 1),
//   chi^2 = sum w_j (x_j / X - 1)^2 X^2
//
// with s = 1 unless chi^2 of the n samples exceeds its mean by more than 4 standard deviations.
//
// Which samples count is decided by X as well. The longest exposure that is not saturated tells
// roughly where the others lie; what it puts more than a factor e below the curve's lower end is
// left out at once: a picture's darkest codes stand for no exposure. Then from the longest exposure
// on one leaves while X predicts a code within 4 standard deviations of the curve's upper end and
// the next is on the curve at all, at last from the shortest on while X lies below its lower end. X
// is each time the efficient estimate, uncorrelated with what the sample adds to it, hence the
// choice leaves no bias. Saturated pixels and their neighbours never count; the codes below the
// curve's lower end are not clipped, so that no margin is needed there.
//
// A pixel off the curve in all pictures is flagged and holds its best estimate with a sigma of its
// own:
//
//   too dark    the curve continued below its lower end l, whose X would be l / t of the longest
//               picture: sigma^2 grows by the mean square distance of X from anything between 0 and
//               l / t, which is (l / t)^2 / 12 + (X - l / (2 t))^2
//   saturated   the exposure of the shortest picture's code, a lower bound; sigma is as large
//
// What is neither but has its last sample within d standard deviations r of the upper end has lost
// those that noise saturated: sigma grows by r X phi(d) / Phi(d), the mean of what is left below
// the mean of all (phi, Phi the normal density and distribution).
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/reconstruct/bracket/exposure_ratios.h"
#include "luxfield/reconstruct/calibrate/response/picture_stack.h"
#include "luxfield/reconstruct/calibrate/response/response_curve.h"

namespace luxfield::reconstruct {

// A sample that counts.
struct StackSample {
  int exposure = 0;
  double radiance = 0;           // x_j
  double relative_variance = 0;  // v_j
};

struct PixelRadiance {
  double value = 0, sigma = 0;
  double count = 0;                // effective number of exposures, (sum w)^2 / sum w^2
  std::uint32_t mask = 0;          // lightfield::MeasurementFlag: kSaturated or kTooDark
  double misfit = 0, degrees = 0;  // chi^2 of its samples about it
};

// One channel's merger: tables of the curve by code and of its noise by exposure.
class ResponseMerger {
 public:
  ResponseMerger(const ResponseCurve& curve, int bits);

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
  double LogExposure(double radiance, const StackSample* sample) const;
  void Collect(std::span<const std::uint16_t> codes, std::span<const std::uint8_t> usable,
               std::span<const double> exposures_s);
  double Estimate(double radiance);
  double Choose();
  void StateRange(PixelRadiance& pixel) const;

  std::vector<double> exposure_;       // I by code
  std::vector<Prediction> predicted_;  // by ln I, kSteps from lowest_ on
  double lowest_ = 0, step_ = 0;
  double low_ = 0, high_ = 0;  // ln I of the curve's ends
  double saturation_code_;
  std::vector<StackSample> all_;
  std::vector<double> log_t_;  // of all_
  StackSample *first_ = nullptr, *last_ = nullptr;
};

// Of a channel: how many pixels are flagged, and how well the samples of the others agree.
struct MergeFigures {
  double pixels = 0, saturated = 0, too_dark = 0;
  double chi_squared = 0, degrees = 0;

  void Add(const PixelRadiance& pixel);
  MergeFigures& operator+=(const MergeFigures& other);
};

struct MergedPicture {
  core::Image radiance;  // exposures of the reference code per second
  core::Image sigma, count;
  std::vector<std::uint32_t> mask;    // planes as radiance
  std::vector<double> exposures_s;    // as used
  std::vector<MergeFigures> figures;  // of the channels
};

// `curves` one per channel. Throws InputError where they are not as many as the stack's channels.
MergedPicture MergeStack(const PictureStack& stack, std::span<const ResponseCurve> curves);

// The pictures' true over their nominal exposures, by some 20000 pixels a channel, from the merge
// with the nominal ones; the longest keeps its own. In the pictures that the response was
// calibrated from, the curve has taken errors of the exposures in and hides most of them.
ExposureRatios::Result EstimateExposures(const PictureStack& stack,
                                         std::span<const ResponseCurve> curves);

// docs/formats/merged-picture.md. Reading leaves exposures_s and figures empty and throws
// InputError for a file of another kind.
bool IsMergedPicture(const std::filesystem::path& path);
MergedPicture ReadMergedPicture(const std::filesystem::path& path);
void WriteMergedPicture(const std::filesystem::path& path, const MergedPicture& merged,
                        const std::map<std::string, std::string>& provenance);

}  // namespace luxfield::reconstruct
