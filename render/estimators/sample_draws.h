// Samplers without what their samples are drawn for, so that benches can time the draw.
#pragma once

#include <memory>
#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

// The sampler of estimator "windowed", "cells", "uniform", "basis" or "precomputed" alone: draws
// its samples and adds them up unshaded. InputError on other names.
std::unique_ptr<Estimator> MakeSampleDraws(const std::string& sampler, const Device& device);

}  // namespace luxfield::render
