#include "luxfield/render/estimators/windowed.h"

#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& WindowedTraits() {
  static const EstimatorTraits traits = SamplingTraits(
      "windowed",
      "unbiased for receivers at any distance, with bounded contributions and one shadow ray "
      "per sample");
  return traits;
}

std::unique_ptr<Estimator> MakeWindowed(const Device& device, const std::string& build_options) {
  return MakeSamplingEstimator(device, WindowedTraits(), "kernels/luminaire/windowed.cl",
                               "Windowed", build_options);
}

}  // namespace luxfield::render
