// What was taken for the rim, drawn into the photograph for the user to judge.
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/probe_optics.h"
#include "luxfield/reconstruct/calibrate/mirror_ball/rim_fit.h"

namespace luxfield::reconstruct {

// Linear, 0 to 1, three channels: the photograph x / (x + twice the median of its brightness), the
// fitted circle in yellow, edges that are on it in green and those that are not in red.
core::Image DrawRim(const core::Image& radiance, const RimFit& rim);

}  // namespace luxfield::reconstruct
