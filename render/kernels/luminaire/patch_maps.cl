// Shadow maps of the filter plane's patches: inverse depths by rasterising triangles in homogeneous
// coordinates (Olano and Greer 1997), which is a ray from the patch's point through every texel's
// centre without any triangle being clipped. Of vertices a, b, c counted from the point, a
// direction d = (x, y, 1) meets the triangle where
//
//   d.(a x b), d.(b x c) and d.(c x a) have the sign of det = a.((b - a) x (c - a)),
//   1 / depth = d.((b - a) x (c - a)) / det
#include "luxfield/render/kernels/luminaire/patch_types.clh"
#include "luxfield/render/kernels/luminaire/window.clh"
#include "luxfield/render/kernels/scene/bvh_types.clh"

// Triangles that lie before F, as they look from the luminaire: found[0] of them, in any order.
__kernel void GatherPatchTriangles(__constant const LuminaireParams* luminaire,
                                   __global const BvhTriangle* triangles, int count,
                                   __global PatchTriangle* found_triangles, __global int* found) {
  const int k = get_global_id(0);
  if (k >= count) return;
  __global const float4* memory = (__global const float4*)(triangles + k);
  __constant const DoubleFloat* o = luminaire->position;
  const float3 hi = (float3)(o[0].hi, o[1].hi, o[2].hi), lo = (float3)(o[0].lo, o[1].lo, o[2].lo);
  const float3 a = LuminaireFromWorld(luminaire, (memory[0].xyz - hi) - lo),
               b = LuminaireFromWorld(luminaire, (memory[1].xyz - hi) - lo),
               c = LuminaireFromWorld(luminaire, (memory[2].xyz - hi) - lo);
  if (!(fmax(a.z, fmax(b.z, c.z)) > 0.0f)) return;
  __global float4* to = (__global float4*)(found_triangles + atomic_inc(found));
  to[0] = (float4)(a, 0.0f);
  to[1] = (float4)(b, 0.0f);
  to[2] = (float4)(c, 0.0f);
}

// Each product is rounded by itself, so that the two sides of an edge that triangles share differ
// in nothing but the sign: no direction passes between them.
static inline float3 EdgeNormal(float3 a, float3 b) {
#pragma OPENCL FP_CONTRACT OFF
  const float3 first = a.yzx * b.zxy, second = a.zxy * b.yzx;
  return first - second;
}

// Texels [x, z) x [y, w) whose centres the triangle may cover.
static inline int4 CoveredTexels(float3 a, float3 b, float3 c, float2 low, float inverse_texel,
                                 int size) {
  if (!(fmin(a.z, fmin(b.z, c.z)) > 0.0f)) return (int4)(0, 0, size, size);
  const float2 ta = a.xy / a.z, tb = b.xy / b.z, tc = c.xy / c.z;
  // Half a texel is left out of the border, a hundredth is for rounding.
  const float2 first = (fmin(ta, fmin(tb, tc)) - low) * inverse_texel - 0.51f,
               last = (fmax(ta, fmax(tb, tc)) - low) * inverse_texel + 0.51f;
  const float most = (float)size;
  return (int4)((int)clamp(first.x, 0.0f, most), (int)clamp(first.y, 0.0f, most),
                (int)clamp(last.x, 0.0f, most), (int)clamp(last.y, 0.0f, most));
}

// Rows [first_row, last_row) of one map. `size` is a multiple of 16.
static inline void DrawTriangle(__global const float4* triangle, float3 point, float2 low,
                                float texel, int size, float nearest, int first_row, int last_row,
                                __global float* map) {
  const float3 a = triangle[0].xyz - point, b = triangle[1].xyz - point,
               c = triangle[2].xyz - point;
  const int4 covered = CoveredTexels(a, b, c, low, 1.0f / texel, size);
  const int top = max(covered.y, first_row), bottom = min(covered.w, last_row);
  if (top >= bottom || covered.x >= covered.z) return;
  const float3 plane = cross(b - a, c - a);
  const float det = dot(a, plane);
  if (det == 0.0f) return;
  const float side = copysign(1.0f, det);
  const float3 ab = side * EdgeNormal(a, b), bc = side * EdgeNormal(b, c),
               ca = side * EdgeNormal(c, a), inverse_depth = plane / det;
  const float16 lanes = (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const float most = 1.0f / nearest;
  for (int row = top; row < bottom; ++row) {
    const float y = low.y + ((float)row + 0.5f) * texel;
    const float ab_y = fma(y, ab.y, ab.z), bc_y = fma(y, bc.y, bc.z), ca_y = fma(y, ca.y, ca.z),
                depth_y = fma(y, inverse_depth.y, inverse_depth.z);
    for (int column = covered.x & ~15; column < covered.z; column += 16) {
      const float16 x = low.x + (((float)column + 0.5f) + lanes) * texel;
      const float16 inside =
          fmin(fma(x, (float16)(ab.x), (float16)(ab_y)),
               fmin(fma(x, (float16)(bc.x), (float16)(bc_y)),
                    fma(x, (float16)(ca.x), (float16)(ca_y))));
      const float16 w = fma(x, (float16)(inverse_depth.x), (float16)(depth_y));
      __global float* texels = map + row * size + column;
      const float16 before = vload16(0, texels);
      const int16 drawn = inside >= 0.0f && w > before && w < most;
      vstore16(select(before, w, drawn), 0, texels);
    }
  }
}

// map[(patch * size + row) * size + column]: 1 / z of the nearest surface, 0 where there is none.
// Item (patch, band of rows).
__kernel void DrawPatchMaps(__constant const PatchParams* patches,
                            __global const PatchTriangle* triangles, __global const int* found,
                            int bands, __global float* maps) {
  const int item = get_global_id(0), patch = item / bands, band = item % bands;
  if (patch >= kPatchCount || !(patches->lit >> patch & 1u)) return;
  const int size = patches->size, rows = (size + bands - 1) / bands, first_row = band * rows,
            last_row = min(first_row + rows, size);
  __global float* map = maps + (size_t)patch * size * size;
  for (int k = first_row * size; k < last_row * size; k += 16) vstore16(0.0f, 0, map + k);
  const float3 point = (float3)(patches->x[patch], patches->y[patch], 0.0f);
  const float2 low = (float2)(patches->low_x[patch], patches->low_y[patch]);
  const int count = found[0];
  for (int k = 0; k < count; ++k)
    DrawTriangle((__global const float4*)(triangles + k), point, low, patches->texel, size,
                 patches->nearest, first_row, last_row, map);
}
