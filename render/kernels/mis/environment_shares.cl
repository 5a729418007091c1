// How samples that follow an environment map are shared out to its faces, seen from a pixel.
#define GLOSSY 0
#include "luxfield/render/kernels/mis/light_environment.clh"

// Six floats a pixel, of sum 1; 0 where nothing was hit and where no lit tile is preferred.
__kernel void FaceShares(LIGHT_ARGUMENTS, SURFACE_ARGUMENTS, int pixels, __global float* shares) {
  const int pixel = get_global_id(0);
  if (pixel >= pixels) return;
  for (int face = 0; face < 6; ++face) shares[6 * pixel + face] = 0.0f;
  Light light;
  if (positions[pixel].w == 0.0f || !MakeLight(LIGHT, pixel, SURFACE(pixel), &light)) return;
  const int per_face = light.ranges / 6;
  for (int range = 0; range < light.ranges; ++range)
    shares[6 * pixel + range / per_face] += RangeShare(&light, range);
}
