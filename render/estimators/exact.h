// Irradiance in closed form; with shadows, times a sampled visible share (docs/theory.md 7.1, 7.3).
#pragma once

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& ExactTraits();
std::unique_ptr<Estimator> MakeExact(const Device& device);

}  // namespace luxfield::render
