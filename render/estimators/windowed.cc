#include "render/estimators/windowed.h"

#include "render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& WindowedTraits() {
  static const EstimatorTraits traits{
      .name = "windowed",
      .needs = {.sat = true},
      .needs_non_negative = true,
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .guarantee =
          "unbiased for receivers at any distance, with bounded contributions and one shadow ray "
          "per sample; the variance of one pass takes samples as independent and so overstates the "
          "error"};
  return traits;
}

std::unique_ptr<Estimator> MakeWindowed(const Device& device) {
  return MakeSamplingEstimator(device, WindowedTraits(), "kernels/windowed.cl", "Windowed");
}

}  // namespace luxfield::render
