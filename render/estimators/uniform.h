// Uniform points in each image's window on I, images allotted samples in proportion to their
// windows' mass: a baseline (docs/theory.md 6). What is drawn is uniform over the part of the
// window that lies on the image; contributions grow with max C / mean C in a window.
#pragma once

#include <string>

#include "luxfield/render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& UniformTraits();
// `build_options` are added to those of its kernels.
std::unique_ptr<Estimator> MakeUniform(const Device& device, const std::string& build_options = {});

}  // namespace luxfield::render
