#include "luxfield/render/estimators/precomputed.h"

#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& PrecomputedTraits() {
  static const EstimatorTraits traits = SamplingTraits(
      "precomputed",
      "the baseline of precomputed light importance sampling: points drawn from all of C "
      "wherever the receiver is; unbiased but for receivers on the image plane, which get "
      "nothing, and very noisy near it");
  return traits;
}

std::unique_ptr<Estimator> MakePrecomputed(const Device& device, const std::string& build_options) {
  return MakeSamplingEstimator(device, PrecomputedTraits(), "kernels/luminaire/precomputed.cl",
                               "Precomputed", build_options);
}

}  // namespace luxfield::render
