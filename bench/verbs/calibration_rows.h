// The rows of `luxfield bench calibrate`.
#pragma once

#include <span>

#include "luxfield/core/json.h"
#include "luxfield/render/accuracy/cost_model.h"

namespace luxfield::bench {

// [{"estimator", "pixels", "images", "texels", "spp", "rays", "measured_s", "predicted_s"}, ...] of
// the runs: images, texels, samples ("spp") and rays are those of one pixel.
core::Json CalibrationRows(std::span<const render::CalibrationRun> runs);

}  // namespace luxfield::bench
