// The picture of a scene whose luminaires are the simulated lamp itself (traced_lamp.h), on the
// surfaces that the renderer sees, shadows by the scene's own triangles.
#pragma once

#include <cstdint>

#include "luxfield/planning/reference_picture.h"
#include "luxfield/planning/traced_lamp.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/scene/scene.h"

namespace luxfield::planning {

struct LampPictureOptions {
  int width = 0, height = 0;  // 0: the scene's
  int points = 233;           // of each of two shifts, per luminaire and pixel
  std::uint64_t seed = 1;
};

struct LampPicture {
  ReferencePicture irradiance, radiance;  // nothing in the way of the light
  ReferencePicture shadowed;              // radiance, with what is in its way
};

// All luminaires of the scene shine as the lamp does, by their scales. `lit` is `scene` on a
// device. Throws InputError for scenes with glossy surfaces.
LampPicture TraceLampPicture(const render::LitScene& lit, const scene::Scene& scene,
                             const TracedLamp& lamp, const LampPictureOptions& options);

// Free of the noise of the reference; rel_rmse is no less than its own.
StageError ErrorAgainst(const core::Image& image, const ReferencePicture& truth);

}  // namespace luxfield::planning
