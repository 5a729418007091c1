// Pictures by error or time of scenes that area lights and an environment map light
// (study/accuracy.h).
#pragma once

#include "study/accuracy.h"

namespace luxfield::study {

// There is one estimator for each light to choose, whose error is the spread of four passes of
// samples of their own. A picture of 3072 pixels at most says how many samples the error, or the
// time, needs; the whole picture then takes more until its own spread keeps the error, with the
// margin that PictureNoise states for 95 %. A request in time is served in one round.
//
// Throws InputError for shared or interleaved sets of samples: their errors are alike from pixel to
// pixel, which the margin takes as independent.
AccurateFrame RenderPassesToAccuracy(render::LitScene& scene, const AccuracyRequest& request);

}  // namespace luxfield::study
