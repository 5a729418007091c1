#include "luxfield/render/estimators/basis.h"

#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& BasisTraits() {
  static const EstimatorTraits traits = SamplingTraits(
      "basis",
      "unbiased for receivers at any distance: points drawn from Phi on the filter plane; "
      "nearly free of noise where windows are smaller than a texel, noisy where they hold "
      "structure");
  return traits;
}

std::unique_ptr<Estimator> MakeBasis(const Device& device, const std::string& build_options) {
  return MakeSamplingEstimator(device, BasisTraits(), "kernels/luminaire/windowed.cl", "Windowed",
                               "-D PROPOSAL=BASIS " + build_options);
}

}  // namespace luxfield::render
