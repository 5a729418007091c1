// An estimator that is one kernel over windows: those of cells where its traits need them. Internal
// to estimators/.
#pragma once

#include <memory>
#include <string>

#include "luxfield/render/estimators/window_sampler.h"

namespace luxfield::render {

// Of a sampler that claims no bias and takes any BRDF and all shadows.
EstimatorTraits SamplingTraits(const std::string& name, const std::string& guarantee,
                               const TableNeeds& needs = {.sat = true});

// `kernel` of `path`, with LIGHTING_ARGUMENTS behind those of WindowSampler. The traits must
// outlive the estimator.
std::unique_ptr<Estimator> MakeSamplingEstimator(const Device& device,
                                                 const EstimatorTraits& traits,
                                                 const std::string& path, const std::string& kernel,
                                                 const std::string& build_options = {});

}  // namespace luxfield::render
