// What a scene's camera sees, taken from the device: for light that is worked out on the host.
#pragma once

#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/render/lit_scene.h"
#include "luxfield/render/renderer.h"

namespace luxfield::planning {

// Pixel by pixel as in render::GBuffer, through the pixels' centres.
struct SeenSurfaces {
  int width = 0, height = 0;
  std::vector<cl_float4> position, normal, albedo;

  std::size_t pixel_count() const { return position.size(); }
  bool hit(std::size_t pixel) const { return position[pixel].s[3] != 0; }
  // albedo / pi of a channel: what a Lambertian surface sends to the eye of its irradiance.
  double reflectance(std::size_t pixel, int channel) const;
};

// Of the size that `picture` names; 0 is the scene's.
SeenSurfaces SeeSurfaces(const render::LitScene& scene, const render::RenderOptions& picture);

}  // namespace luxfield::planning
