// A rectangular or spherical light as kernels see it.
#pragma once

#include "luxfield/render/kernels/area/area_light_types.clh"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

struct AreaLightSource {
  scene::AreaLightKind kind = scene::AreaLightKind::kRectangle;
  AreaLightParams params{};
};

AreaLightSource MakeAreaLight(const scene::AreaLight& light);

}  // namespace luxfield::render
