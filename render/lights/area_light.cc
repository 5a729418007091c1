#include "luxfield/render/lights/area_light.h"

namespace luxfield::render {

AreaLightSource MakeAreaLight(const scene::AreaLight& light) {
  AreaLightParams params{};
  const scene::Pose& pose = light.world_from_light;
  const double centre[] = {pose.translation.x, pose.translation.y, pose.translation.z};
  for (int row = 0; row < 3; ++row) {
    params.position[row] = static_cast<float>(centre[row]);
    params.radiance[row] = static_cast<float>(light.radiance[row]);
    // The inverse of a rotation is its transpose.
    for (int column = 0; column < 3; ++column)
      params.rotation[3 * row + column] = static_cast<float>(pose.linear[column][row]);
  }
  params.half_size[0] = static_cast<float>(light.width_m / 2);
  params.half_size[1] = static_cast<float>(light.height_m / 2);
  params.radius = static_cast<float>(light.radius_m);
  return {light.kind, params};
}

}  // namespace luxfield::render
