#include "luxfield/render/estimators/cells.h"

#include "luxfield/render/estimators/sampling_estimator.h"

namespace luxfield::render {

const EstimatorTraits& CellsTraits() {
  static const EstimatorTraits traits = SamplingTraits(
      "cells",
      "unbiased for receivers at any distance, with bounded contributions and one "
      "shadow ray per sample, at a fraction of the variance of windowed; shadow maps "
      "count cell by cell",
      {.cells = true});
  return traits;
}

std::unique_ptr<Estimator> MakeCells(const Device& device, const std::string& build_options) {
  return MakeSamplingEstimator(device, CellsTraits(), "kernels/luminaire/cells.cl", "Cells",
                               build_options);
}

}  // namespace luxfield::render
