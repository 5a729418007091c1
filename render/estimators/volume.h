// Irradiance from the light-vector volume (THEORY.md 7.2): one tricubic look-up per pixel, whatever
// the number of images.
//
// The volume covers what preprocess::ReachOf was given. Pixels that may see light outside that
// reach or nearer than its largest tau are lit by `exact`. Where the receiver's horizon cuts the
// supports n . J is not the irradiance: these pixels are lit texel by texel, as `exact` lights them
// but for the texels on the horizon (kernels/volume.cl states the bound). Nothing is extrapolated
// and no n . J is clamped. Light() waits for the numbers of such pixels.
#pragma once

#include "render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& VolumeTraits();
std::unique_ptr<Estimator> MakeVolume(const Device& device);

// The surface points of a G-buffer in a luminaire's frame, for preprocess::BuildForReceivers.
std::vector<preprocess::Receiver> ReceiversOf(const GBuffer& gbuffer,
                                              const scene::Pose& world_from_luminaire);

}  // namespace luxfield::render
