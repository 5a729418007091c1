#include "render/estimators/precomputed.h"

#include "render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& PrecomputedTraits() {
  static const EstimatorTraits traits{
      .name = "precomputed",
      .needs = {.sat = true},
      .needs_non_negative = true,
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .guarantee =
          "the baseline of precomputed light importance sampling: points drawn from all of C "
          "wherever the receiver is; unbiased but for receivers on the image plane, which get "
          "nothing, and very noisy near it"};
  return traits;
}

std::unique_ptr<Estimator> MakePrecomputed(const Device& device) {
  return MakeSamplingEstimator(device, PrecomputedTraits(), "kernels/precomputed.cl",
                               "Precomputed");
}

}  // namespace luxfield::render
