// Irradiance from the light-vector volume (docs/theory.md 7.2; preprocess/light_vector_volume.h):
//
//   E = tau^2 / z (n_x (B1_u - p_x B0) + n_y (B1_v - p_y B0) - n_z z B0),   p_xy from the centre
//
// with B0, B1 tricubic in (a_x, a_y, tau): 64 float4 coefficients per channel, read as 16 rows of
// four.
#include "luxfield/render/kernels/luminaire/cut_horizon.clh"
#include "luxfield/render/kernels/luminaire/pixel_vectors.clh"
#include "luxfield/render/kernels/luminaire/volume_types.clh"

// True if the windows of a receiver at `a` meet the images along one axis.
inline int16 MeetsImages(__constant const VolumeParams* volume, int dimension, float16 a,
                         float16 shrink) {
  const float16 half_window = shrink * volume->extent[dimension];
  return a + half_window >= volume->image_low[dimension] &&
         a - half_window <= volume->image_high[dimension];
}

inline float16 Position(__constant const VolumeAxisParams* axis, float16 x) {
  return (x - axis->first) * axis->inverse_spacing;
}

inline int16 IsInside(__constant const VolumeAxisParams* axis, float16 position) {
  return (int16)(axis->cells > 0 ? -1 : 0) &
         (position >= 0.0f && position <= (float)axis->cells);
}

// What a work-item reads the table with, a lane or an entry for each pixel.
typedef struct Stencils {
  int offset[kPixels];         // of the first coefficient, floats
  float across[4][kPixels];    // weights along a_x
  float rows[16][kPixels];     // along tau and a_y, [4 tau + a_y]
} Stencils;

// Cubic B-spline weights of coefficients k .. k + 3 at k + f.
inline void SplineWeights(float16 f, float16 weight[4]) {
  const float16 g = 1.0f - f, third = (float16)(2.0f / 3.0f), sixth = (float16)(1.0f / 6.0f);
  weight[0] = sixth * g * g * g;
  weight[1] = fma(f * f, fma((float16)(0.5f), f, (float16)(-1.0f)), third);
  weight[2] = fma(g * g, fma((float16)(0.5f), g, (float16)(-1.0f)), third);
  weight[3] = sixth * f * f * f;
}

inline int16 Cell(__constant const VolumeAxisParams* axis, float16 position) {
  return min(convert_int16(position), (int16)(axis->cells - 1));
}

// The nearest position that the table covers: weights of one far outside would overflow.
inline float16 Covered(__constant const VolumeAxisParams* axis, float16 position) {
  return fmin(fmax(position, 0.0f), (float)axis->cells);
}

inline void MakeStencils(__constant const VolumeParams* volume, float16 at_x, float16 at_y,
                         float16 at_tau, Stencils* stencils) {
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const int16 x = Cell(&volume->axis[0], at_x), y = Cell(&volume->axis[1], at_y),
              tau = Cell(&volume->axis[2], at_tau);
  vstore16(4 * (tau * slice + y * line + x), 0, stencils->offset);
  float16 across[4], down[4], ahead[4];
  SplineWeights(at_x - convert_float16(x), across);
  SplineWeights(at_y - convert_float16(y), down);
  SplineWeights(at_tau - convert_float16(tau), ahead);
  for (int i = 0; i < 4; ++i) {
    vstore16(across[i], 0, stencils->across[i]);
    for (int j = 0; j < 4; ++j) vstore16(ahead[i] * down[j], 0, stencils->rows[4 * i + j]);
  }
}

// The 16 rows of four neighbours in a_x that pixels of a cell of the table read, [4 tau + a_y].
typedef struct Rows {
  float16 row[16];
} Rows;

inline __attribute__((always_inline)) void LoadRows(__global const float* base, int line, int slice,
                                                    Rows* rows) {
#pragma unroll
  for (int i = 0; i < 4; ++i)
#pragma unroll
    for (int j = 0; j < 4; ++j)
      rows->row[4 * i + j] = vload16(0, base + 4 * ((size_t)i * slice + j * line));
}

// (B0, B1_u, B1_v, -) of one channel and kPixels pixels, one after the other. Neighbouring pixels
// mostly lie in one cell of the table, whose rows stay in registers. The slices' sums are
// independent: no chain of additions is longer than six.
inline __attribute__((always_inline)) void Interpolate(__global const float* coefficients, int line,
                                                       int slice, const Stencils* stencils,
                                                       float moments[4 * kPixels]) {
  int offset = stencils->offset[0];
  Rows rows;
  LoadRows(coefficients + offset, line, slice, &rows);
  for (int k = 0; k < kPixels; ++k) {
    if (stencils->offset[k] != offset) {
      offset = stencils->offset[k];
      LoadRows(coefficients + offset, line, slice, &rows);
    }
    float16 sum[4];
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      sum[i] = stencils->rows[4 * i][k] * rows.row[4 * i];
#pragma unroll
      for (int j = 1; j < 4; ++j)
        sum[i] = fma((float16)(stencils->rows[4 * i + j][k]), rows.row[4 * i + j], sum[i]);
    }
    const float16 all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    vstore4(fma((float4)(stencils->across[0][k]), all.s0123, stencils->across[1][k] * all.s4567) +
                fma((float4)(stencils->across[2][k]), all.s89ab,
                    stencils->across[3][k] * all.scdef),
            k, moments);
  }
}

// Of the light that reaches a pixel; `share` (may be null: all of it) is that of patch_shares.cl.
inline float ShareOf(__global const float* share, int pixel) { return share ? share[pixel] : 1.0f; }

// UnclippedError of kPixels receivers.
inline float16 UnclippedErrors(__constant const LuminaireParams* luminaire, Vectors n, float16 z,
                               float16 shrink) {
  const float h = luminaire->axis[0].spacing.hi;
  return (fabs(n.x) * fabs(1.0f / luminaire->axis[0].step.hi) +
          fabs(n.y) * fabs(1.0f / luminaire->axis[1].step.hi)) *
         h / (8.0f * z * shrink);
}

// left[0] pixels of `by_exact` from left[2] on, left[1] of `unclipped` from the end down.
inline void ListLeft(int16 by_exact, int16 unclipped, int first, int pixel_count,
                     __global int* left) {
  int exact[kPixels], fine[kPixels];
  vstore16(by_exact, 0, exact);
  vstore16(unclipped, 0, fine);
  for (int k = 0; k < kPixels; ++k) {
    if (exact[k]) left[2 + atomic_inc(left)] = first + k;
    if (fine[k]) left[1 + pixel_count - atomic_inc(left + 1)] = first + k;
  }
}

// Adds `e` of every channel to kPixels pixels.
inline void AddToPixels(const float16* e, int channels, int first, int count,
                        __global const float4* ratio, __global float4* irradiance,
                        __global float* variance) {
  const float16 r = e[0], g = channels == 3 ? e[1] : r, b = channels == 3 ? e[2] : r, none = 0.0f;
  const float16 sum[4] = {
      (float16)(r.s0, g.s0, b.s0, none.s0, r.s1, g.s1, b.s1, none.s1, r.s2, g.s2, b.s2, none.s2,
                r.s3, g.s3, b.s3, none.s3),
      (float16)(r.s4, g.s4, b.s4, none.s4, r.s5, g.s5, b.s5, none.s5, r.s6, g.s6, b.s6, none.s6,
                r.s7, g.s7, b.s7, none.s7),
      (float16)(r.s8, g.s8, b.s8, none.s8, r.s9, g.s9, b.s9, none.s9, r.sa, g.sa, b.sa, none.sa,
                r.sb, g.sb, b.sb, none.sb),
      (float16)(r.sc, g.sc, b.sc, none.sc, r.sd, g.sd, b.sd, none.sd, r.se, g.se, b.se, none.se,
                r.sf, g.sf, b.sf, none.sf)};
  if (!ratio && first + kPixels <= count) {
    __global float* to = (__global float*)(irradiance + first);
    for (int k = 0; k < 4; ++k) vstore16(vload16(k, to) + sum[k], k, to);
    return;
  }
  float each[4 * kPixels];
  for (int k = 0; k < 4; ++k) vstore16(sum[k], k, each);
  for (int k = 0; k < min(count - first, (int)kPixels); ++k)
    AddVisible(vload4(k, each).xyz, first + k, ratio, irradiance, variance);
}

// Adds the irradiance of every pixel whose horizon does not cut the luminaire and that the volume
// covers. The other pixels that may see light are listed, in no order: left[0] of them from left[2]
// on, but left[1] whose horizon cuts images so fine that clipping their texels makes no difference
// of `max_error` |J|, from the end down. Item (kPixels pixels).
__kernel void VolumeIrradiance(__constant const LuminaireParams* luminaire,
                               __constant const VolumeParams* volume,
                               __global const float* coefficients,
                               __global const float4* positions, __global const float4* normals,
                               int pixel_count, __global const float4* ratio,
                               __global float4* irradiance, __global float* variance,
                               __global int* left, float max_error,
                               __global const float* share) {
  const int first = (int)get_global_id(0) * kPixels;
  if (first >= pixel_count) return;
  float16 hit, unused;
  const Vectors world = LoadVectors(positions, first, pixel_count, &hit);
  const float16 seen = share ? LoadFloats(share, first, pixel_count) : 1.0f;
  int16 lit = hit != 0.0f && seen != 0.0f;
  if (!AnyOf(lit)) return;
  const Vectors p = PointsInFrame(luminaire, world);
  lit &= p.z > 0.0f;
  const float16 z = fmax(p.z, luminaire->min_z);
  const float16 x = p.x - volume->centre[0], y = p.y - volume->centre[1];
  const float16 tau = luminaire->delta.hi / z, a_x = tau * x, a_y = tau * y;
  const float16 shrink = fabs(1.0f - tau);
  lit &= MeetsImages(volume, 0, a_x, shrink) & MeetsImages(volume, 1, a_y, shrink);
  if (!AnyOf(lit)) return;

  // n . (u - p) over the supports is height +- spread.
  const Vectors n =
      DirectionsInFrame(luminaire, LoadVectors(normals, first, pixel_count, &unused));
  const float16 height = -fma(n.x, x, fma(n.y, y, n.z * z));
  const float16 spread = fabs(n.x) * volume->extent[0] + fabs(n.y) * volume->extent[1];
  lit &= height + spread > 0.0f;
  const float16 rounding = 1e-6f * (fabs(x) + fabs(y) + z);
  const int16 cut = lit & (height - spread < rounding),
              unclipped = cut & (UnclippedErrors(luminaire, n, z, shrink) <= max_error);
  const float16 at_x = Position(&volume->axis[0], a_x), at_y = Position(&volume->axis[1], a_y),
                at_tau = Position(&volume->axis[2], tau);
  const int16 tabulated = lit & ~cut & IsInside(&volume->axis[0], at_x) &
                          IsInside(&volume->axis[1], at_y) & IsInside(&volume->axis[2], at_tau),
              by_exact = lit & ~unclipped & ~tabulated;
  if (AnyOf(unclipped | by_exact)) ListLeft(by_exact, unclipped, first, pixel_count, left);
  if (!AnyOf(tabulated)) return;

  Stencils stencils;
  MakeStencils(volume, Covered(&volume->axis[0], at_x), Covered(&volume->axis[1], at_y),
               Covered(&volume->axis[2], at_tau), &stencils);
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const size_t table = 4 * (size_t)slice * volume->axis[2].coefficients;
  const float16 scale = select((float16)(0.0f), seen * tau * tau / z, tabulated);
  float16 e[3];
  for (int channel = 0; channel < luminaire->channels; ++channel) {
    // Of every pixel, as most are wanted: a branch costs more than it saves.
    float moments[4 * kPixels];
    Interpolate(coefficients + channel * table, line, slice, &stencils, moments);
    const Vectors b = Deinterleave(moments, &unused);  // B0, B1_u, B1_v
    e[channel] = scale * fma(height, b.x, fma(n.x, b.y, n.y * b.z));
  }
  AddToPixels(e, luminaire->channels, first, pixel_count, ratio, irradiance, variance);
}

// Adds the irradiance of the `count` pixels at the end of `left`, whose horizon cuts fine images.
__kernel void VolumeCutIrradiance(__constant const LuminaireParams* luminaire,
                                  __global const float* images, __global const float4* positions,
                                  __global const float4* normals, int pixel_count,
                                  __global const float4* ratio, __global float4* irradiance,
                                  __global float* variance, __global const int* left, int count,
                                  __global const float* share) {
  if ((int)get_global_id(0) >= count) return;
  const int pixel = left[1 + pixel_count - (int)get_global_id(0)];
  const Receiver receiver = MakeReceiver(luminaire, positions[pixel].xyz, normals[pixel].xyz);
  float sum[3];
  LightCutPixel(luminaire, images, &receiver, 0, /*clip=*/false, sum);
  const float seen = ShareOf(share, pixel);
  for (int channel = 0; channel < 3; ++channel) sum[channel] *= seen;
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

// Adds their irradiance, as far as it is seen, to the pixels they came from.
__kernel void ScatterIrradiance(__global const int* pixels, int count,
                                __global const float4* gathered, __global const float4* ratio,
                                __global float4* irradiance, __global float* variance,
                                __global const float* share) {
  const int k = get_global_id(0);
  if (k < count)
    AddVisible(ShareOf(share, pixels[k]) * gathered[k].xyz, pixels[k], ratio, irradiance, variance);
}
