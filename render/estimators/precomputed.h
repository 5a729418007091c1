// Precomputed light importance sampling, a baseline of the thesis (docs/theory.md 6, 11): images
// and texels drawn from one distribution over all C, wherever the receiver is; what misses the
// windows is lost. Its contributions are unbounded as receivers approach I: on I itself nothing
// arrives.
#pragma once

#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& PrecomputedTraits();
// `build_options` are added to those of its kernels.
std::unique_ptr<Estimator> MakePrecomputed(const Device& device,
                                           const std::string& build_options = {});

}  // namespace luxfield::render
