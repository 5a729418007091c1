#include "luxfield/render/estimators/sample_draws.h"

#include "luxfield/core/error.h"
#include "luxfield/render/estimators/basis.h"
#include "luxfield/render/estimators/cells.h"
#include "luxfield/render/estimators/precomputed.h"
#include "luxfield/render/estimators/uniform.h"
#include "luxfield/render/estimators/windowed.h"

namespace luxfield::render {

std::unique_ptr<Estimator> MakeSampleDraws(const std::string& sampler, const Device& device) {
  const std::string only = "-D DRAWS_ONLY=1";
  if (sampler == WindowedTraits().name) return MakeWindowed(device, only);
  if (sampler == CellsTraits().name) return MakeCells(device, only);
  if (sampler == UniformTraits().name) return MakeUniform(device, only);
  if (sampler == BasisTraits().name) return MakeBasis(device, only);
  if (sampler == PrecomputedTraits().name) return MakePrecomputed(device, only);
  throw InputError("there is no sampler '" + sampler +
                   "'; use windowed, cells, uniform, basis or precomputed");
}

}  // namespace luxfield::render
