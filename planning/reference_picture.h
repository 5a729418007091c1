// What pictures are judged by: a closed form, or samples that state their own error.
#pragma once

#include "luxfield/core/image.h"
#include "luxfield/core/measures.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/renderer.h"

namespace luxfield::planning {

// Two unbiased pictures of independent samples, or twice the closed form.
struct ReferencePicture {
  core::Image a, b;
  core::Image mean;
  double rel_rmse = 0;  // standard error of the mean: half the halves' difference
};

// Throws InputError if sizes differ or a value is not finite.
ReferencePicture MakeReference(core::Image a, core::Image b);

// The radiance of the view that `picture` names by its size and shadows (none or traced), through
// the pixels' centres. Lambertian without shadows: the closed form (lightfield::ExactIrradiance, in
// double) on the surfaces that the renderer sees. Else halves of `samples` per pixel together, by
// the unbiased estimator whose variance times core-seconds a pilot finds least; their random
// numbers are no other picture's. They are dealt out by the noise (sample_density.h). With rel_rmse
// above 0, fewer samples where the pilot expects them to reach that error of the luminance. Throws
// InputError (shadow maps have no reference), DeviceError, Interrupted.
ReferencePicture RenderReference(render::LitScene& scene, const render::RenderOptions& picture,
                                 int samples, double rel_rmse = 0);

// The same of the luminance alone.
ReferencePicture LuminanceOf(const ReferencePicture& reference);

// core::Compare against the mean, but with squared errors as (x - a)(x - b): the halves' own noise
// then averages out instead of adding to the error of x. What is left of it can exceed a small
// error or make it negative: rel_rmse is no less than the reference's own.
core::Difference Compare(const core::Image& x, const ReferencePicture& reference);

}  // namespace luxfield::planning
