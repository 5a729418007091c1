// A rectangular or spherical light on a device.
#pragma once

#include "luxfield/render/device/device.h"
#include "luxfield/scene/scene.h"

namespace luxfield::render {

struct AreaLightOnDevice {
  scene::AreaLightKind kind = scene::AreaLightKind::kRectangle;
  Buffer params;  // AreaLightParams, kernels/area/area_light_types.clh
};

AreaLightOnDevice UploadAreaLight(const Device& device, const scene::AreaLight& light);

}  // namespace luxfield::render
