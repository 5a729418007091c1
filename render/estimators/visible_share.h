// What of a luminaire's light reaches a receiver past what shadow rays meet: with it estimators
// without noise get traced shadows (docs/theory.md 7, per image). Of the samples x of `cells`, V
// their visibility and E what all light together brings,
//
//   visible = E v + sum V x - v sum x,   v = sum V |x| / sum |x|
//
// the samples' own visible sum with the part v of their error taken out (a control variate). Where
// no x is negative it is E times a ratio of sums. v lies in [0, 1] whatever the signs, so nothing
// grows where E crosses 0: it is E where nothing is hidden and 0 where all is. Consistent but not
// unbiased: off by the covariance of v and sum x, below the product of their standard deviations.
// Internal to estimators/.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "luxfield/render/estimators/window_sampler.h"

namespace luxfield::render {

class VisibleShare {
 public:
  // Per pixel two float4, with sums over the negative samples alone,
  //   v of each channel, and the relative variance of the visible luminance
  //   2 (v sum |x| - sum V |x|) of each channel, and 2 sum |x| of the luminance
  // so that visible = E v + the second, and its variance that of the first times (E + the last)^2,
  // the square of what all light would bring without signs. Null: everything is visible.
  struct Shares {
    Buffer irradiance;
    Buffer reflected;  // of the radiance towards the eye; null for a Lambertian G-buffer
  };

  explicit VisibleShare(const Device& device) : device_(device) {}

  // Traces what `estimator` asks for and counts light samples to `samples`; nothing where no rays
  // are traced. Throws what WindowSampler::Run throws.
  Shares Trace(const std::string& estimator, const Receivers& receivers,
               const PosedLuminaire& luminaire, const EstimatorOptions& options,
               const Buffer& samples);

 private:
  Kernel& KernelFor(bool glossy);

  Device device_;
  std::optional<WindowSampler> sampler_;  // built when shadows are first asked for
  std::map<bool, Kernel> kernels_;        // by GLOSSY
};

}  // namespace luxfield::render
