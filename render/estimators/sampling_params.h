// What all sampling kernels are told of a launch. Internal to estimators/.
#pragma once

#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/kernels/sample/sampling_types.clh"

namespace luxfield::render {

// Everything that options say and that is not a single estimator's: samples, seed, stream, first
// pixel and, of two strategies, share, pilot and steps. Throws InputError for knobs and samples out
// of range.
SamplingParams MakeSamplingParams(const EstimatorOptions& options);

}  // namespace luxfield::render
