// The environment behind a scene.
#pragma once

#include "luxfield/render/lights/environment_light.h"
#include "luxfield/render/scene/device_scene.h"

namespace luxfield::render {

class EnvironmentBackground {
 public:
  explicit EnvironmentBackground(const Device& device);  // builds the kernel (cached on disk)

  // Radiance (linear Rec. 709 in xyz) towards the camera where the rays of a G-buffer, rows
  // [first_row, first_row + gbuffer.height) of the camera's picture, hit nothing; 0 elsewhere:
  // float4. Enqueues and returns. `sample` as PrimaryVisibility::Render has it.
  Buffer Render(const EnvironmentLight& light, const scene::Camera& camera, int first_row,
                lightfield::Vec2 sample, const GBuffer& gbuffer);

 private:
  Device device_;
  Kernel kernel_;
};

}  // namespace luxfield::render
