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

// What a work-item reads the table with, a lane for each pixel.
typedef struct Stencils {
  int16 offset;       // of the first coefficient, floats
  float16 across[4];  // weights along a_x
  float16 rows[16];   // along tau and a_y, [4 tau + a_y]
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
  stencils->offset = 4 * (tau * slice + y * line + x);
  float16 down[4], ahead[4];
  SplineWeights(at_x - convert_float16(x), stencils->across);
  SplineWeights(at_y - convert_float16(y), down);
  SplineWeights(at_tau - convert_float16(tau), ahead);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) stencils->rows[4 * i + j] = ahead[i] * down[j];
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
      rows->row[4 * i + j] = LoadSixteen(base + 4 * ((size_t)i * slice + j * line));
}

// (B0, B1_u, B1_v, -) of one channel and kPixels pixels, one after the other. Neighbouring pixels
// mostly lie in one cell of the table, whose rows stay in registers. The slices' sums are
// independent: no chain of additions is longer than six.
inline __attribute__((always_inline)) void Interpolate(__global const float* coefficients, int line,
                                                       int slice, const Stencils* stencils,
                                                       float4 moments[kPixels]) {
  const int* offsets = (const int*)&stencils->offset;
  int offset = offsets[0];
  Rows rows;
  LoadRows(coefficients + offset, line, slice, &rows);
  for (int k = 0; k < kPixels; ++k) {
    if (offsets[k] != offset) {
      offset = offsets[k];
      LoadRows(coefficients + offset, line, slice, &rows);
    }
    float16 sum[4];
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      sum[i] = FloatOf(&stencils->rows[4 * i], k) * rows.row[4 * i];
#pragma unroll
      for (int j = 1; j < 4; ++j)
        sum[i] = fma((float16)(FloatOf(&stencils->rows[4 * i + j], k)), rows.row[4 * i + j],
                     sum[i]);
    }
    const float16 all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    moments[k] = fma((float4)(FloatOf(&stencils->across[0], k)), all.s0123,
                     FloatOf(&stencils->across[1], k) * all.s4567) +
                 fma((float4)(FloatOf(&stencils->across[2], k)), all.s89ab,
                     FloatOf(&stencils->across[3], k) * all.scdef);
  }
}

inline int SmallestIntOf(int16 x) {
  const int8 a = min(x.lo, x.hi);
  const int4 b = min(a.lo, a.hi);
  const int2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}

// Pixels whose cells are one, or two side by side in a_x: each coefficient is read once for all.
typedef struct SharedStencils {
  int offset, nodes;   // of the first cell; 4 or 5 neighbours in a_x
  float16 across[5];  // weights along a_x, from the first cell's on
} SharedStencils;

// False if the cells of the pixels that are wanted lie elsewhere.
inline bool ShareStencils(const Stencils* stencils, int16 wanted, SharedStencils* shared) {
  shared->offset = SmallestIntOf(select((int16)(INT_MAX), stencils->offset, wanted));
  const int16 from_first = select((int16)(0), stencils->offset - shared->offset, wanted);
  if (AnyOf(from_first != 0 & from_first != 4)) return false;
  const int16 next = from_first == 4;
  shared->nodes = AnyOf(next) ? 5 : 4;
  const float16 none = 0.0f;
  shared->across[0] = select(stencils->across[0], none, next);
  for (int n = 1; n < 4; ++n)
    shared->across[n] = select(stencils->across[n], stencils->across[n - 1], next);
  shared->across[4] = select(none, stencils->across[3], next);
  return true;
}

// B0, B1_u, B1_v of `channels` channels, whose tables lie `table` floats apart, of pixels that share
// them: a lane is a pixel, and the compiler knows `channels` and `nodes`.
inline __attribute__((always_inline)) void InterpolateShared(
    __global const float* first, int line, int slice, size_t table, const SharedStencils* shared,
    const float16 rows[16], const int channels, const int nodes, Vectors moments[3]) {
  enum { kSums = 2 };  // independent ones: no chain of additions waits for the one before
  Vectors sum[3][kSums];
#pragma unroll
  for (int channel = 0; channel < channels; ++channel)
#pragma unroll
    for (int k = 0; k < kSums; ++k)
      sum[channel][k].x = sum[channel][k].y = sum[channel][k].z = 0.0f;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      __global const float* row = first + 4 * ((size_t)i * slice + j * line);
#pragma unroll
      for (int n = 0; n < nodes; ++n) {
        const float16 weight = rows[4 * i + j] * shared->across[n];
        const int k = channels == 1 ? n % kSums : 0;
#pragma unroll
        for (int channel = 0; channel < channels; ++channel) {
          __global const float* node = row + channel * table + 4 * n;
          Vectors* to = &sum[channel][k];
          to->x = fma(weight, (float16)(node[0]), to->x);
          to->y = fma(weight, (float16)(node[1]), to->y);
          to->z = fma(weight, (float16)(node[2]), to->z);
        }
      }
    }
#pragma unroll
  for (int channel = 0; channel < channels; ++channel) {
    const Vectors a = sum[channel][0], b = sum[channel][1];
    moments[channel] = (Vectors){a.x + b.x, a.y + b.y, a.z + b.z};
  }
}

// (B0, B1_u, B1_v) of every channel. Of every pixel, as most are wanted: a branch for each costs more
// than it saves.
inline void InterpolateAll(__global const float* coefficients, int line, int slice, size_t table,
                           const Stencils* stencils, int16 wanted, int channels,
                           Vectors moments[3]) {
  SharedStencils shared;
  if (ShareStencils(stencils, wanted, &shared)) {
    __global const float* first = coefficients + shared.offset;
    if (channels == 3 && shared.nodes == 4)
      InterpolateShared(first, line, slice, table, &shared, stencils->rows, 3, 4, moments);
    else if (channels == 3)
      InterpolateShared(first, line, slice, table, &shared, stencils->rows, 3, 5, moments);
    else if (shared.nodes == 4)
      InterpolateShared(first, line, slice, table, &shared, stencils->rows, 1, 4, moments);
    else
      InterpolateShared(first, line, slice, table, &shared, stencils->rows, 1, 5, moments);
    return;
  }
  for (int channel = 0; channel < channels; ++channel) {
    float16 each[4], unused;
    Interpolate(coefficients + channel * table, line, slice, stencils, (float4*)each);
    moments[channel] = Transposed(each, &unused);
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

// left[0] pixels of `by_exact` from left[2] on, left[1] of `unclipped` from the end down, as ~pixel
// those that also are `tabulated`.
inline void ListLeft(int16 by_exact, int16 unclipped, int16 tabulated, int first, int pixel_count,
                     __global int* left) {
  const int *exact = (const int*)&by_exact, *fine = (const int*)&unclipped,
            *whole = (const int*)&tabulated;
  for (int k = 0; k < kPixels; ++k) {
    if (exact[k]) left[2 + atomic_inc(left)] = first + k;
    if (fine[k])
      left[1 + pixel_count - atomic_inc(left + 1)] = whole[k] ? ~(first + k) : first + k;
  }
}

// Adds `e` of every channel to kPixels pixels.
inline void AddToPixels(const float16* e, int channels, int first, int count,
                        __global const float4* ratio, __global float4* irradiance,
                        __global float* variance) {
  float16 sum[4];
  if (channels == 3) {
    const Vectors light = {e[0], e[1], e[2]};
    Interleave(light, 0.0f, sum);
  } else {
    const float4 once = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
    const float16 white = (float16)(once, once, once, once), y = e[0];
    sum[0] = white * (float16)(y.s0000, y.s1111, y.s2222, y.s3333);
    sum[1] = white * (float16)(y.s4444, y.s5555, y.s6666, y.s7777);
    sum[2] = white * (float16)(y.s8888, y.s9999, y.saaaa, y.sbbbb);
    sum[3] = white * (float16)(y.scccc, y.sdddd, y.seeee, y.sffff);
  }
  if (!ratio && first + kPixels <= count) {
    __global float* to = (__global float*)(irradiance + first);
    for (int k = 0; k < 4; ++k, to += 16) StoreSixteen(LoadSixteen(to) + sum[k], to);
    return;
  }
  const float4* each = (const float4*)sum;
  for (int k = 0; k < min(count - first, (int)kPixels); ++k)
    AddVisible(each[k].xyz, first + k, ratio, irradiance, variance);
}

// Adds the irradiance of every pixel whose horizon does not cut the luminaire and that the volume
// covers. The other pixels that may see light are listed, in no order: left[0] of them from left[2]
// on, but left[1] whose horizon cuts images so fine that clipping their texels makes no difference
// of `max_error` |J|, from the end down. Of these, those that see the middle of the supports get the
// integral of g here, unless they are lit by shares of rays (`ratio`), and are listed as ~pixel: they
// lack that of max(0, -g), which is of fewer images than that of max(0, g) = g + max(0, -g). Item
// (kPixels pixels).
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
  // With shares of rays a pixel is lit once: its variance grows with the square of its light.
  const int16 from_behind = ratio ? (int16)(0) : unclipped & height > 0.0f;
  const int16 tabulated = lit & (~cut | from_behind) &
                          IsInside(&volume->axis[0], at_x) & IsInside(&volume->axis[1], at_y) &
                          IsInside(&volume->axis[2], at_tau),
              by_exact = lit & ~unclipped & ~tabulated;
  if (AnyOf(unclipped | by_exact))
    ListLeft(by_exact, unclipped, tabulated, first, pixel_count, left);
  if (!coefficients || !AnyOf(tabulated)) return;

  Stencils stencils;
  MakeStencils(volume, Covered(&volume->axis[0], at_x), Covered(&volume->axis[1], at_y),
               Covered(&volume->axis[2], at_tau), &stencils);
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const size_t table = 4 * (size_t)slice * volume->axis[2].coefficients;
  const float16 scale = select((float16)(0.0f), seen * tau * tau / z, tabulated);
  Vectors b[3];
  InterpolateAll(coefficients, line, slice, table, &stencils, tabulated, luminaire->channels, b);
  float16 e[3];
  for (int channel = 0; channel < luminaire->channels; ++channel)
    e[channel] = scale * fma(height, b[channel].x, fma(n.x, b[channel].y, n.y * b[channel].z));
  AddToPixels(e, luminaire->channels, first, pixel_count, ratio, irradiance, variance);
}

// Adds the irradiance of the `count` pixels at the end of `left`, whose horizon cuts fine images, or of
// those listed as ~pixel what they lack: their irradiance from behind.
__kernel void VolumeCutIrradiance(__constant const LuminaireParams* luminaire,
                                  __global const float* images, __global const float4* positions,
                                  __global const float4* normals, int pixel_count,
                                  __global const float4* ratio, __global float4* irradiance,
                                  __global float* variance, __global const int* left, int count,
                                  __global const float* share) {
  if ((int)get_global_id(0) >= count) return;
  const int listed = left[1 + pixel_count - (int)get_global_id(0)];
  const int pixel = listed < 0 ? ~listed : listed;
  const float side = listed < 0 ? -1.0f : 1.0f;
  const Receiver receiver =
      MakeReceiver(luminaire, positions[pixel].xyz, side * normals[pixel].xyz);
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
