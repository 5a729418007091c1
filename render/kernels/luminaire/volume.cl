// Irradiance from the light-vector volume (docs/theory.md 7.2; preprocess/light_vector_volume.h):
//
//   E = tau^2 / z (n_x (B1_u - p_x B0) + n_y (B1_v - p_y B0) - n_z z B0),   p_xy from the centre
//
// with B0, B1 tricubic in (a_x, a_y, tau): 64 float4 coefficients per channel, read as 16 rows of
// four.
#include "luxfield/render/kernels/luminaire/cut_horizon.clh"
#include "luxfield/render/kernels/luminaire/volume_types.clh"

// Cubic B-spline weights of coefficients k .. k + 3 at k + f.
inline float4 SplineWeights(float f) {
  const float4 c0 = (float4)(1.0f / 6.0f, 2.0f / 3.0f, 1.0f / 6.0f, 0.0f),
               c1 = (float4)(-0.5f, 0.0f, 0.5f, 0.0f), c2 = (float4)(0.5f, -1.0f, 0.5f, 0.0f),
               c3 = (float4)(-1.0f / 6.0f, 0.5f, -0.5f, 1.0f / 6.0f), at = (float4)(f);
  return fma(at, fma(at, fma(at, c3, c2), c1), c0);
}

typedef struct Stencil {
  int first;  // coefficient
  float4 weight;
} Stencil;

inline Stencil MakeStencil(__constant const VolumeAxisParams* axis, float position) {
  Stencil stencil;
  stencil.first = clamp((int)position, 0, axis->cells - 1);
  stencil.weight = SplineWeights(position - (float)stencil.first);
  return stencil;
}

inline float Position(__constant const VolumeAxisParams* axis, float x) {
  return (x - axis->first) * axis->inverse_spacing;
}

inline bool IsInside(__constant const VolumeAxisParams* axis, float position) {
  return axis->cells > 0 && position >= 0.0f && position <= (float)axis->cells;
}

// True if the windows of a receiver at `a` meet the images along one axis.
inline bool MeetsImages(__constant const VolumeParams* volume, int dimension, float a,
                        float shrink) {
  const float half_window = shrink * volume->extent[dimension];
  return a + half_window >= volume->image_low[dimension] &&
         a - half_window <= volume->image_high[dimension];
}

// Four neighbours in a_x of each of four rows, summed over the rows.
inline __attribute__((always_inline)) float16 SumRows(__global const float* rows, int line,
                                                      float4 weight) {
  float16 sum = weight.x * vload16(0, rows);
  sum = fma((float16)(weight.y), vload16(0, rows + 4 * line), sum);
  sum = fma((float16)(weight.z), vload16(0, rows + 8 * line), sum);
  return fma((float16)(weight.w), vload16(0, rows + 12 * line), sum);
}

// (B0, B1_u, B1_v, -) of one channel. The slices' sums are independent: no chain of additions is
// longer than eight.
inline __attribute__((always_inline)) float4 Interpolate(__global const float* coefficients,
                                                         int line, int slice, Stencil x, Stencil y,
                                                         Stencil tau) {
  __global const float* base =
      coefficients + 4 * ((size_t)tau.first * slice + (size_t)y.first * line + x.first);
  const size_t next = 4 * (size_t)slice;
  const float16 slice0 = SumRows(base, line, y.weight),
                slice1 = SumRows(base + next, line, y.weight),
                slice2 = SumRows(base + 2 * next, line, y.weight),
                slice3 = SumRows(base + 3 * next, line, y.weight);
  const float16 sum = fma((float16)(tau.weight.x), slice0, tau.weight.y * slice1) +
                      fma((float16)(tau.weight.z), slice2, tau.weight.w * slice3);
  return fma((float4)(x.weight.x), sum.s0123, x.weight.y * sum.s4567) +
         fma((float4)(x.weight.z), sum.s89ab, x.weight.w * sum.scdef);
}

// Columns of luminaire_from_world, then the luminaire's place: what MakeReceiver computes, without
// taking rows apart.
inline float4 InFrame(float16 columns, float4 v) {
  return fma(columns.s0123, (float4)(v.x),
             fma(columns.s4567, (float4)(v.y), columns.s89ab * v.z));
}

// Adds the irradiance of every pixel whose horizon does not cut the luminaire and that the volume
// covers. The other pixels that may see light are listed, in no order: left[0] of them from left[2]
// on, but left[1] whose horizon cuts images so fine that clipping their texels makes no difference
// of `max_error` |J|, from the end down.
__kernel void VolumeIrradiance(__constant const LuminaireParams* luminaire,
                               __constant const VolumeParams* volume,
                               __global const float* coefficients,
                               __global const float4* positions, __global const float4* normals,
                               int pixel_count, __global const float4* ratio,
                               __global float4* irradiance, __global float* variance,
                               __global int* left, float16 columns, float4 origin_lo,
                               float max_error) {
  const int pixel = get_global_id(0);
  const float4 position = positions[pixel < pixel_count ? pixel : 0];
  if (pixel >= pixel_count || position.w == 0.0f) return;
  const float4 p = InFrame(columns, (position - columns.scdef) - origin_lo);
  if (!(p.z > 0.0f)) return;
  const float z = fmax(p.z, luminaire->min_z);
  const float x = p.x - volume->centre[0], y = p.y - volume->centre[1];
  const float tau = luminaire->delta.hi / z, a_x = tau * x, a_y = tau * y;
  const float shrink = fabs(1.0f - tau);
  if (!MeetsImages(volume, 0, a_x, shrink) || !MeetsImages(volume, 1, a_y, shrink)) return;

  // n . (u - p) over the supports is height +- spread.
  const float4 n = InFrame(columns, normals[pixel]);
  const float height = -(n.x * x + n.y * y + n.z * z);
  const float spread = fabs(n.x) * volume->extent[0] + fabs(n.y) * volume->extent[1];
  if (height + spread <= 0.0f) return;
  const float rounding = 1e-6f * (fabs(x) + fabs(y) + z);
  const float at_x = Position(&volume->axis[0], a_x), at_y = Position(&volume->axis[1], a_y),
              at_tau = Position(&volume->axis[2], tau);
  const bool cut = height - spread < rounding;
  if (cut && UnclippedError(luminaire, n, z, shrink) <= max_error) {
    left[1 + pixel_count - atomic_inc(left + 1)] = pixel;
    return;
  }
  if (cut || !IsInside(&volume->axis[0], at_x) || !IsInside(&volume->axis[1], at_y) ||
      !IsInside(&volume->axis[2], at_tau)) {
    left[2 + atomic_inc(left)] = pixel;
    return;
  }

  const Stencil stencil_x = MakeStencil(&volume->axis[0], at_x),
                stencil_y = MakeStencil(&volume->axis[1], at_y),
                stencil_tau = MakeStencil(&volume->axis[2], at_tau);
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const size_t table = 4 * (size_t)slice * volume->axis[2].coefficients;
  const float4 direction =
      (tau * tau / z) * (float4)(-(n.x * x + n.y * y + n.z * z), n.x, n.y, 0.0f);
  float3 e = dot(direction, Interpolate(coefficients, line, slice, stencil_x, stencil_y,
                                        stencil_tau));
  if (luminaire->channels == 3) {
    e.y = dot(direction, Interpolate(coefficients + table, line, slice, stencil_x, stencil_y,
                                     stencil_tau));
    e.z = dot(direction, Interpolate(coefficients + 2 * table, line, slice, stencil_x, stencil_y,
                                     stencil_tau));
  }
  AddVisible(e, pixel, ratio, irradiance, variance);
}

// Adds the irradiance of the `count` pixels at the end of `left`, whose horizon cuts fine images.
__kernel void VolumeCutIrradiance(__constant const LuminaireParams* luminaire,
                                  __global const float* images, __global const float4* positions,
                                  __global const float4* normals, int pixel_count,
                                  __global const float4* ratio, __global float4* irradiance,
                                  __global float* variance, __global const int* left, int count) {
  if ((int)get_global_id(0) >= count) return;
  const int pixel = left[1 + pixel_count - (int)get_global_id(0)];
  const Receiver receiver = MakeReceiver(luminaire, positions[pixel].xyz, normals[pixel].xyz);
  float sum[3];
  LightCutPixel(luminaire, images, &receiver, 0, /*clip=*/false, sum);
  AddIrradiance(luminaire, receiver.p.z, sum, pixel, ratio, irradiance, variance);
}

// Receivers `pixels[0 .. count - 1]` as a G-buffer of their own.
__kernel void GatherReceivers(__global const int* pixels, int count,
                              __global const float4* positions, __global const float4* normals,
                              __global float4* gathered_positions,
                              __global float4* gathered_normals) {
  const int k = get_global_id(0);
  if (k >= count) return;
  gathered_positions[k] = positions[pixels[k]];
  gathered_normals[k] = normals[pixels[k]];
}

// Adds their irradiance to the pixels they came from.
__kernel void ScatterIrradiance(__global const int* pixels, int count,
                                __global const float4* gathered, __global const float4* ratio,
                                __global float4* irradiance, __global float* variance) {
  const int k = get_global_id(0);
  if (k < count) AddVisible(gathered[k].xyz, pixels[k], ratio, irradiance, variance);
}
