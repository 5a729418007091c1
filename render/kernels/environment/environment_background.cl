// The environment as a camera sees it behind a scene.
#include "luxfield/render/kernels/environment/environment_sampling.clh"
#include "luxfield/render/kernels/math/frame.clh"
#include "luxfield/render/kernels/scene/pinhole.clh"

// Radiance where rays hit nothing, 0 elsewhere.
__kernel void Background(ENVIRONMENT_ARGUMENTS, PinholeCamera camera,
                         __global const float4* positions, __global float4* radiance) {
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= camera.width || row >= camera.rows) return;
  const int pixel = row * camera.width + column;
  radiance[pixel] = (float4)(0.0f);
  if (positions[pixel].w != 0.0f) return;
  const Environment environment = ENVIRONMENT;
  const float3 direction = PixelDirection(&camera, column, row);
  radiance[pixel].xyz =
      EnvironmentAt(&environment, LocalFromWorld(environment.params->rotation, direction)).radiance;
}
