// Shadow maps of a luminaire's u-cells (thesis 4.5.2, docs/theory.md 6): depths by rays through the
// texels' centres, and which cells every pixel sees.
#include "luxfield/render/kernels/luminaire/shadow_map_types.clh"
#include "luxfield/render/kernels/luminaire/window.clh"
#include "luxfield/scene/ray_types.clh"

// The rays through texels [first, first + count) of all maps, a map's row by row; maps of cells
// without light get rays of no length. A ray has z = 1, so that its parameter is the depth.
__kernel void CastShadowMaps(__constant const LuminaireParams* luminaire,
                             __global const ShadowView* views, int size, ulong first, int count,
                             __global PackedRay* rays) {
  const int item = get_global_id(0);
  if (item >= count) return;
  const size_t at = first + item, texels = (size_t)size * size;
  const int texel = (int)(at % texels);
  const ShadowView view = views[at / texels];
  __constant const DoubleFloat* o = luminaire->position;
  const float3 origin =
      (float3)(o[0].hi, o[1].hi, o[2].hi) +
      WorldFromLuminaire(luminaire, (float3)(view.origin[0], view.origin[1], view.origin[2]));
  const float3 direction = WorldFromLuminaire(
      luminaire, (float3)(view.low[0] + ((float)(texel % size) + 0.5f) * view.texel[0],
                          view.low[1] + ((float)(texel / size) + 0.5f) * view.texel[1], 1.0f));
  __global PackedRay* ray = rays + item;
  vstore3(origin, 0, ray->origin);
  vstore3(direction, 0, ray->direction);
  // A surface in the plane of the origin must not blind the map by rounding.
  const float3 extent = fabs(origin);
  ray->t_min = 1e-6f + 1e-6f * fmax(extent.x, fmax(extent.y, extent.z));
  ray->t_max = view.lit ? MAXFLOAT : 0.0f;
}

// depth[(cell * size + row) * size + column]: distance along the luminaire's z from the view's
// origin to the nearest surface, INFINITY where there is none.
__kernel void StoreDepths(ulong first, int count, __global const PackedHit* hits,
                          __global float* depth) {
  const int item = get_global_id(0);
  if (item < count) depth[first + item] = hits[item].t;
}

// False if the map shows something between the receiver and the view's origin.
//
// The texel that holds the receiver was seen through its centre, up to half a diagonal away. So the
// receiver is lifted off its surface by that much: no texel then sees a plane in front of a point
// of that plane, at whatever angle. kShadowTilt leaves room for interpolated normals.
static inline bool Sees(const ShadowView* view, __global const float* depth, int size,
                        const Receiver* receiver, float rounding) {
  const float2 low = (float2)(view->low[0], view->low[1]),
               texel = (float2)(view->texel[0], view->texel[1]);
  float3 q = receiver->p - (float3)(view->origin[0], view->origin[1], view->origin[2]);
  const float reach = kShadowTilt * 0.5f * length(texel);
  // Lifting may take the receiver away from the view, where texels are wider: a geometric series.
  q += (rounding + q.z * reach / (1.0f - reach)) * receiver->normal;
  if (!(q.z > 0.0f)) return true;
  const float2 place = (q.xy / q.z - low) / texel;
  if (!(all(place >= 0.0f) && all(place < (float)size))) return true;
  return depth[(int)place.y * size + (int)place.x] >= q.z;
}

// seen[pixel * words + cell / 32], bit cell % 32; words = cells / 32 rounded up. Cells without
// light, places outside a map and behind its origin count as seen.
__kernel void SeeCells(__constant const LuminaireParams* luminaire,
                       __global const ShadowView* views, int cells, int size,
                       __global const float* depth, __global const float4* positions,
                       __global const float4* normals, int pixel_count, __global uint* seen) {
  const int pixel = get_global_id(0);
  if (pixel >= pixel_count || positions[pixel].w == 0.0f) return;
  const Receiver receiver = MakeReceiver(luminaire, positions[pixel].xyz, normals[pixel].xyz);
  // Of the position, the map's origin and the depth together.
  const float3 extent = fabs(positions[pixel].xyz);
  const float rounding = 1e-6f + 1e-5f * fmax(extent.x, fmax(extent.y, extent.z));
  const int words = (cells + 31) / 32;
  for (int word = 0; word < words; ++word) {
    uint bits = 0u;
    for (int cell = 32 * word; cell < min(32 * word + 32, cells); ++cell) {
      const ShadowView view = views[cell];
      __global const float* map = depth + (size_t)cell * size * size;
      if (!view.lit || Sees(&view, map, size, &receiver, rounding))
        bits |= 1u << (cell - 32 * word);
    }
    seen[(size_t)pixel * words + word] = bits;
  }
}
