// Exact energy of every piece of the luminaire times the BRDF at that energy's centroid
// (docs/theory.md 7.4, kernels/luminaire/gloss.cl).
#pragma once

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& GlossTraits();
std::unique_ptr<Estimator> MakeGloss(const Device& device);

}  // namespace luxfield::render
