// Irradiance from the light-vector volume (THEORY.md 7.2): one tricubic look-up per pixel, whatever
// the number of images.
//
// The volume covers what preprocess::ReachOf was given. Every other pixel that may see light
// (outside that reach, nearer than its largest tau, with a horizon that cuts the supports) is lit
// by `exact`: nothing is extrapolated and no n . J is clamped. Light() waits for the number of
// those pixels.
#pragma once

#include "render/estimators/estimator.h"

namespace luxfield::render {

const EstimatorTraits& VolumeTraits();
std::unique_ptr<Estimator> MakeVolume(const Device& device);

// The surface points of a G-buffer in a luminaire's frame, for preprocess::BuildForReceivers.
std::vector<preprocess::Receiver> ReceiversOf(const GBuffer& gbuffer,
                                              const scene::Pose& world_from_luminaire);

}  // namespace luxfield::render
