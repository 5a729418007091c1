// What soft shadow maps do to a picture, measured against traced shadows at a small picture of the
// same view.
#pragma once

#include "luxfield/render/renderer.h"

namespace luxfield::render {

struct SoftMapsError {
  // Relative RMSE of the luminance (docs/theory.md 10), less the noise of what it is measured
  // against; 0 where it is below that.
  double rel_error = 0;
  double mean_lab = 0;  // mean CIE 1976 difference, noise included
};

// Of pictures by `options`, whose shadows are soft maps; some 3000 pixels, 512 samples of each
// luminaire. Throws what Renderer throws.
SoftMapsError MeasureSoftMaps(LitScene& scene, const RenderOptions& options);

}  // namespace luxfield::render
