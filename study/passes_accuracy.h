// Pictures by error or time of scenes that area lights and an environment map light
// (study/accuracy.h).
#pragma once

#include "study/accuracy.h"

namespace luxfield::study {

// There is one estimator for each light, and nothing to choose but samples. A picture of 3072 pixels
// at most, by the spread of four passes at two sample counts, says how many the error, or the time,
// needs. They are taken in one pass, whose samples are stratified together; further rounds follow
// until the picture's error, measured at pixels that are lit again (render/relit_pixels.h), is kept
// with the margin that PictureNoise states for 95 %. A request in time is served in one round.
//
// Throws InputError for shared or interleaved sets of samples: their errors are alike from pixel to
// pixel, which the margin takes as independent.
AccurateFrame RenderPassesToAccuracy(render::LitScene& scene, const AccuracyRequest& request);

}  // namespace luxfield::study
