#include "render/estimators/sample_draws.h"

#include "core/error.h"
#include "render/estimators/basis.h"
#include "render/estimators/cells.h"
#include "render/estimators/precomputed.h"
#include "render/estimators/sampling_estimator.h"
#include "render/estimators/uniform.h"
#include "render/estimators/windowed.h"

namespace luxfield::render {

std::unique_ptr<Estimator> MakeSampleDraws(const std::string& sampler, const Device& device) {
  const std::string only = "-D DRAWS_ONLY=1 ";
  if (sampler == "windowed")
    return MakeSamplingEstimator(device, WindowedTraits(), "kernels/windowed.cl", "Windowed", only);
  if (sampler == "cells")
    return MakeSamplingEstimator(device, CellsTraits(), "kernels/cells.cl", "Cells", only);
  if (sampler == "uniform")
    return MakeSamplingEstimator(device, UniformTraits(), "kernels/windowed.cl", "Windowed",
                                 only + "-D PROPOSAL=UNIFORM");
  if (sampler == "basis")
    return MakeSamplingEstimator(device, BasisTraits(), "kernels/windowed.cl", "Windowed",
                                 only + "-D PROPOSAL=BASIS");
  if (sampler == "precomputed")
    return MakeSamplingEstimator(device, PrecomputedTraits(), "kernels/precomputed.cl",
                                 "Precomputed", only);
  throw InputError("there is no sampler '" + sampler +
                   "'; use windowed, cells, uniform, basis or precomputed");
}

}  // namespace luxfield::render
