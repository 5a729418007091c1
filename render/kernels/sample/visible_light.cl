// What arrives of the light kept with a batch of shadow rays, once they are traced.
#include "luxfield/render/kernels/sample/totals.clh"

// Adds it for pixels [begin, begin + count), item k being pixel begin + k.
__kernel void AddVisibleLight(int begin, int count, int capacity, SHADOW_RAY_ARGUMENTS,
                              __global const uchar* hidden, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, capacity, item);
  __global const uchar* hidden_rays = hidden + (size_t)item * (size_t)capacity;
  Totals totals = NoLight();
  totals.count = shadow.pending->samples;
  for (int k = 0; k < shadow.range->end; ++k)
    if (!hidden_rays[k]) AddToVisible(KeptContribution(&shadow, k), &totals);
  StoreScaled(&totals, shadow.pending->scale, begin + item, LIGHTING);
}
