#include "luxfield/render/lights/environment_background.h"

namespace luxfield::render {

EnvironmentBackground::EnvironmentBackground(const Device& device)
    : device_(device),
      kernel_(Program::Build(device, "kernels/environment/environment_background.cl"),
              "Background") {}

Buffer EnvironmentBackground::Render(const EnvironmentLight& light, const scene::Camera& camera,
                                     int first_row, lightfield::Vec2 sample,
                                     const GBuffer& gbuffer) {
  const PinholeCamera pinhole =
      MakePinhole(camera, gbuffer.width, first_row, gbuffer.height, sample);
  Buffer radiance(device_, gbuffer.pixel_count() * sizeof(cl_float4));
  kernel_
      .Set(light.params(), light.texels(), light.row_starts(), light.column_starts(),
           light.energies(), light.corners(), pinhole, gbuffer.position, radiance)
      .Enqueue({static_cast<std::size_t>(gbuffer.width), static_cast<std::size_t>(gbuffer.height)},
               {16, 4});
  return radiance;
}

}  // namespace luxfield::render
