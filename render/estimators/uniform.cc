#include "luxfield/render/estimators/uniform.h"

#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& UniformTraits() {
  static const EstimatorTraits traits = SamplingTraits(
      "uniform",
      "a baseline: uniform points in each image's window, images in proportion to their "
      "windows' mass; unbiased, noisy where windows hold structure");
  return traits;
}

std::unique_ptr<Estimator> MakeUniform(const Device& device, const std::string& build_options) {
  return MakeSamplingEstimator(device, UniformTraits(), "kernels/luminaire/windowed.cl", "Windowed",
                               "-D PROPOSAL=UNIFORM " + build_options);
}

}  // namespace luxfield::render
