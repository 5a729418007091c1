#include "luxfield/planning/seen_surfaces.h"

#include <numbers>

namespace luxfield::planning {

double SeenSurfaces::reflectance(std::size_t pixel, int channel) const {
  return double{albedo[pixel].s[channel]} * std::numbers::inv_pi;
}

SeenSurfaces SeeSurfaces(const render::LitScene& scene, const render::RenderOptions& picture) {
  scene::Camera camera = scene.camera();
  if (picture.width > 0) camera.width = picture.width;
  if (picture.height > 0) camera.height = picture.height;
  render::GBuffer gbuffer(scene.device(), camera.width, camera.height);
  render::PrimaryVisibility(scene.device())
      .Render(scene.geometry(), camera, 0, {0.5, 0.5}, gbuffer)
      .Wait();
  return {camera.width, camera.height, gbuffer.position.Download<cl_float4>(),
          gbuffer.normal.Download<cl_float4>(), gbuffer.albedo.Download<cl_float4>()};
}

}  // namespace luxfield::planning
