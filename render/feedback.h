// What guides the samples of a picture, pixel by pixel (thesis chapter 5): the balance between light
// and BRDF, and how many images a lamp lights with.
//
//   const Feedback feedback = MeasureFeedback(scene, {});   // of the scene's camera
//   feedback.light_share.at(0, row, column)                 // 1 on matt floors, less in highlights
#pragma once

#include <cstdint>

#include "luxfield/core/image.h"
#include "luxfield/render/lit_scene.h"

namespace luxfield::render {

struct FeedbackOptions {
  int most_pixels = 12288;  // of its pictures, which have the camera's proportions
  int samples_per_light = 128;
  int pilot = 64;  // of these (render/estimators/mis.h)
  bool shadows = true;
  std::uint64_t seed = 1;
};

// One channel each; NaN where nothing was hit.
struct Feedback {
  // alpha: the share of samples that follow the light and not the BRDF, chosen by Newton steps from a
  // pilot; the mean over the lights, weighed by the luminance that each brings, 1/2 where none does.
  core::Image light_share;
  // render/image_shares.h; NaN where no luminaire sends light, too. Empty of scenes without any.
  core::Image image_share;
};

// Throws InputError where there is no light, DeviceError, Interrupted.
Feedback MeasureFeedback(LitScene& scene, const FeedbackOptions& options);

}  // namespace luxfield::render
