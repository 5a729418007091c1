#include "render/estimators/uniform.h"

#include "render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& UniformTraits() {
  static const EstimatorTraits traits{
      .name = "uniform",
      .needs = {.sat = true},
      .needs_non_negative = true,
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .guarantee =
          "a baseline: uniform points in each image's window, images in proportion to their "
          "windows' mass; unbiased, noisy where windows hold structure"};
  return traits;
}

std::unique_ptr<Estimator> MakeUniform(const Device& device) {
  return MakeSamplingEstimator(device, UniformTraits(), "kernels/windowed.cl", "Windowed",
                               "-D PROPOSAL=UNIFORM");
}

}  // namespace luxfield::render
