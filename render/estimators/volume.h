// Irradiance from the light-vector volume (docs/theory.md 7.2): one tricubic look-up per pixel,
// whatever the number of images.
//
// The volume covers what preprocess::ReachOf was given. Pixels that may see light outside that
// reach or nearer than its largest tau are lit by `exact`. Where the receiver's horizon cuts the
// supports n . J is not the irradiance: these pixels are lit by `exact` too, or, where images are
// so fine that no clipped texel could matter by half of EstimatorOptions::max_error of |J|, texel
// by texel without clipping any (kernels/luminaire/cut_horizon.clh): by the images before the horizon,
// or, where most are, by n . J of the table and the images behind it, since max(0, g) = g + max(0, -g).
// Nothing is extrapolated and no n . J is clamped. Light() waits for the numbers of such pixels. A volume without coefficients lights
// no pixel that it covers: of a luminaire in groups of columns (lightfield/field_columns.h) the first
// has the volume of all, and the others one of the same axes without coefficients.
#pragma once

#include <span>
#include <vector>

#include "luxfield/preprocess/light_vector_volume.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/scene/transform.h"

namespace luxfield::render {

const EstimatorTraits& VolumeTraits();
std::unique_ptr<Estimator> MakeVolume(const Device& device);

// Irradiance by an estimator that takes no samples, asked for `max_error`, of receivers in the
// luminaire's frame.
std::vector<cl_float4> LightReceivers(const Device& device, Estimator& estimator,
                                      const LuminaireOnDevice& luminaire,
                                      std::span<const preprocess::JudgedReceiver> receivers,
                                      double max_error);

// Relative RMSE (docs/theory.md 10) of what LightReceivers lights them with: by `volume`, of the
// table, of the closed form in float32 where that stands in for it, and of what decides between the
// two. 0 if there are no receivers.
double RelativeRmse(std::span<const preprocess::JudgedReceiver> receivers,
                    std::span<const cl_float4> lit);

// The surface points of a G-buffer in a luminaire's frame, for preprocess::BuildForReceivers.
std::vector<preprocess::Receiver> ReceiversOf(const GBuffer& gbuffer,
                                              const scene::Pose& world_from_luminaire);

}  // namespace luxfield::render
