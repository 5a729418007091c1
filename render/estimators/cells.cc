#include "render/estimators/cells.h"

#include "render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& CellsTraits() {
  static const EstimatorTraits traits{
      .name = "cells",
      .needs = {.cells = true},
      .needs_non_negative = true,
      .any_brdf = true,
      .map_shadows = true,
      .unbiased = true,
      .unbiased_with_shadows = true,
      .guarantee =
          "unbiased for receivers at any distance, with bounded contributions and one "
          "shadow ray per sample, at a fraction of the variance of windowed; shadow maps "
          "count cell by cell; the variance of one pass takes samples as independent and "
          "so overstates the error"};
  return traits;
}

std::unique_ptr<Estimator> MakeCells(const Device& device) {
  return MakeSamplingEstimator(device, CellsTraits(), "kernels/cells.cl", "Cells");
}

}  // namespace luxfield::render
