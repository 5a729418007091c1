// Pictures by error or time of scenes that an environment map or area lights light, alone or with
// luminaires (render/accuracy/accuracy.h).
#pragma once

#include <memory>

#include "luxfield/render/accuracy/accuracy.h"

namespace luxfield::render {

// Pictures of 3072 pixels at most, by the spread of four passes at two sample counts and by the
// clock, say what samples of each light leave of noise and what they cost; luminaires do so through
// every estimator that states its error. The samples are dealt out over the lights so that the
// error takes least time, or the time leaves least error (render/accuracy/light_samples.h), and the
// estimator that does best so is taken. They are taken in one pass, whose samples are stratified
// together; further rounds follow until the picture's error, measured at pixels that are lit again
// (render/film/relit_pixels.h), is kept with the margin that PictureNoise states for 95 %. What a
// round shows of each light deals out the next one. Of a time, part is taken first, and the rest at
// the pace that showed.
//
// What an estimator's approximation is off, relative to the luminaires' light, counts in proportion
// to their share of the luminance.
std::unique_ptr<AccurateRendering> BeginRenderingLights(LitScene& scene,
                                                        const AccuracyRequest& request);

}  // namespace luxfield::render
