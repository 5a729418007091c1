// Irradiance from the light-vector volume (docs/theory.md 7.2; preprocess/light_vector_volume.h):
//
//   E = tau^2 / z (n_x (B1_u - p_x B0) + n_y (B1_v - p_y B0) - n_z z B0),   p_xy from the centre
//
// with B0, B1 tricubic in (a_x, a_y, tau): 64 coefficients each per channel, [channel][B0, B1_u, B1_v][tau]
// [a_y][a_x]. Pixels side by side mostly share a cell of the table, or cells side by side, and read each
// coefficient once for all of them, a lane each. Those of one plane share n and n . p, too: the bracket is
// taken of the coefficients, a third of the multiply-adds.
#include "luxfield/render/kernels/luminaire/cut_horizon.clh"
#include "luxfield/render/kernels/luminaire/pixel_vectors.clh"
#include "luxfield/render/kernels/luminaire/volume_types.clh"

// True if the windows of a receiver at `a` meet the images along one axis.
static inline int16 MeetsImages(__constant const VolumeParams* volume, int dimension, float16 a,
                                float16 shrink) {
  const float16 half_window = shrink * volume->extent[dimension];
  return a + half_window >= volume->image_low[dimension] &&
         a - half_window <= volume->image_high[dimension];
}

static inline float16 Position(__constant const VolumeAxisParams* axis, float16 x) {
  return (x - axis->first) * axis->inverse_spacing;
}

static inline int16 IsInside(__constant const VolumeAxisParams* axis, float16 position) {
  return (int16)(axis->cells > 0 ? -1 : 0) & (position >= 0.0f && position <= (float)axis->cells);
}

// What a work-item reads the table with, a lane for each pixel.
typedef struct Stencils {
  int16 offset;       // of the first coefficient
  float16 across[4];  // weights along a_x
  float16 rows[16];   // along tau and a_y, [4 tau + a_y]
} Stencils;

// Cubic B-spline weights of coefficients k .. k + 3 at k + f.
static inline void SplineWeights(float16 f, float16 weight[4]) {
  const float16 g = 1.0f - f, third = (float16)(2.0f / 3.0f), sixth = (float16)(1.0f / 6.0f);
  weight[0] = sixth * g * g * g;
  weight[1] = fma(f * f, fma((float16)(0.5f), f, (float16)(-1.0f)), third);
  weight[2] = fma(g * g, fma((float16)(0.5f), g, (float16)(-1.0f)), third);
  weight[3] = sixth * f * f * f;
}

static inline int16 Cell(__constant const VolumeAxisParams* axis, float16 position) {
  return min(convert_int16(position), (int16)(axis->cells - 1));
}

// The nearest position that the table covers: weights of one far outside would overflow.
static inline float16 Covered(__constant const VolumeAxisParams* axis, float16 position) {
  return fmin(fmax(position, 0.0f), (float)axis->cells);
}

static inline void MakeStencils(__constant const VolumeParams* volume, float16 at_x, float16 at_y,
                                float16 at_tau, Stencils* stencils) {
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const int16 x = Cell(&volume->axis[0], at_x), y = Cell(&volume->axis[1], at_y),
              tau = Cell(&volume->axis[2], at_tau);
  stencils->offset = tau * slice + y * line + x;
  float16 down[4], ahead[4];
  SplineWeights(at_x - convert_float16(x), stencils->across);
  SplineWeights(at_y - convert_float16(y), down);
  SplineWeights(at_tau - convert_float16(tau), ahead);
#pragma unroll
  for (int i = 0; i < 4; ++i)
#pragma unroll
    for (int j = 0; j < 4; ++j) stencils->rows[4 * i + j] = ahead[i] * down[j];
}

static inline int SmallestIntOf(int16 x) {
  const int8 a = min(x.lo, x.hi);
  const int4 b = min(a.lo, a.hi);
  const int2 c = min(b.lo, b.hi);
  return min(c.x, c.y);
}

static inline int LargestIntOf(int16 x) { return -SmallestIntOf(-x); }

// Pixels whose cells are one, or up to four side by side in a_x.
enum { kMostCells = 4, kMostNodes = kMostCells + 3, kFewestToShare = 4 };
typedef struct SharedStencils {
  int offset, nodes;           // of the first cell; neighbours in a_x
  float16 across[kMostNodes];  // weights along a_x, from the first cell's on; 0 for other pixels
} SharedStencils;

// Takes the pixels of the first cell and of those beside it from `left`, which has some, and returns them. A
// line has three coefficients more than cells, so that cells of other lines are further away.
static inline int16 TakeShared(const Stencils* stencils, int16* left, SharedStencils* shared) {
  shared->offset = SmallestIntOf(select((int16)(INT_MAX), stencils->offset, *left));
  const int16 cell = stencils->offset - shared->offset;
  const int16 taken = *left & (cell < kMostCells);
  shared->nodes = LargestIntOf(select((int16)(0), cell, taken)) + 4;
  for (int n = 0; n < shared->nodes; ++n) {
    float16 weight = 0.0f;
#pragma unroll
    for (int j = 0; j < 4; ++j)
      weight = select(weight, stencils->across[j], taken & (cell == n - j));
    shared->across[n] = weight;
  }
  *left &= ~taken;
  return taken;
}

// A channel's tables of B0, B1_u and B1_v.
typedef struct TableLayout {
  int line, slice;
  size_t size;  // of each of them
} TableLayout;

// What multiplies B0, B1_u and B1_v, a lane for each pixel.
typedef struct Bracket {
  float16 height, n_x, n_y;
} Bracket;

// Adds the bracket of every channel to `sum`.
__attribute__((always_inline)) static inline void AddShared(
    __global const float* first, TableLayout table, const SharedStencils* shared,
    const float16 rows[16], const Bracket* bracket, const int channels, float16 sum[3]) {
  enum { kSums = 2 };  // independent ones: no chain of additions waits for the one before
  Vectors moments[3][kSums];
#pragma unroll
  for (int channel = 0; channel < channels; ++channel)
#pragma unroll
    for (int k = 0; k < kSums; ++k)
      moments[channel][k].x = moments[channel][k].y = moments[channel][k].z = 0.0f;
  for (int i = 0; i < 4; ++i)
    for (int n = 0; n < shared->nodes; ++n) {
      const float16 across = shared->across[n];
#pragma unroll
      for (int j = 0; j < 4; ++j) {
        __global const float* node = first + (i * table.slice + j * table.line + n);
        const float16 weight = rows[4 * i + j] * across;
        const int k = channels == 1 ? j % kSums : 0;
#pragma unroll
        for (int channel = 0; channel < channels; ++channel, node += 3 * table.size) {
          Vectors* to = &moments[channel][k];
          to->x = fma(weight, (float16)(node[0]), to->x);
          to->y = fma(weight, (float16)(node[table.size]), to->y);
          to->z = fma(weight, (float16)(node[2 * table.size]), to->z);
        }
      }
    }
#pragma unroll
  for (int channel = 0; channel < channels; ++channel) {
    const Vectors a = moments[channel][0], b = moments[channel][1];
    sum[channel] +=
        fma(bracket->height, a.x + b.x, fma(bracket->n_x, a.y + b.y, bracket->n_y * (a.z + b.z)));
  }
}

// The same of pixels with the bracket of `lane`.
__attribute__((always_inline)) static inline void AddSharedPlane(
    __global const float* first, TableLayout table, const SharedStencils* shared,
    const float16 rows[16], const Bracket* bracket, int lane, const int channels, float16 sum[3]) {
  enum { kSums = 4 };
  const float height = FloatOf(&bracket->height, lane), n_x = FloatOf(&bracket->n_x, lane),
              n_y = FloatOf(&bracket->n_y, lane);
  float16 sums[3][kSums];
  float8 nodes[3][4];  // [channel][a_y], of one tau
#pragma unroll
  for (int channel = 0; channel < channels; ++channel)
#pragma unroll
    for (int k = 0; k < kSums; ++k) sums[channel][k] = 0.0f;
  for (int i = 0; i < 4; ++i, first += table.slice) {
#pragma unroll
    for (int channel = 0; channel < channels; ++channel)
#pragma unroll
      for (int j = 0; j < 4; ++j) {
        __global const float* row = first + 3 * channel * table.size + j * table.line;
        nodes[channel][j] = fma(
            (float8)(height), LoadEight(row),
            fma((float8)(n_x), LoadEight(row + table.size), n_y * LoadEight(row + 2 * table.size)));
      }
    for (int n = 0; n < shared->nodes; ++n) {
      const float16 across = shared->across[n];
#pragma unroll
      for (int j = 0; j < 4; ++j) {
        const float16 weight = rows[4 * i + j] * across;
#pragma unroll
        for (int channel = 0; channel < channels; ++channel) {
          const float node = ((const float*)&nodes[channel][j])[n];
          sums[channel][j] = fma(weight, (float16)(node), sums[channel][j]);
        }
      }
    }
  }
#pragma unroll
  for (int channel = 0; channel < channels; ++channel)
    sum[channel] += (sums[channel][0] + sums[channel][1]) + (sums[channel][2] + sums[channel][3]);
}

// The same of pixels that share with few others: one after the other, a lane for each node in a_x.
static inline void AddEach(__global const float* coefficients, TableLayout table,
                           const Stencils* stencils, const Bracket* bracket, int16 taken,
                           int channels, float16 sum[3]) {
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    if (!((const int*)&taken)[pixel]) continue;
    const float height = FloatOf(&bracket->height, pixel), n_x = FloatOf(&bracket->n_x, pixel),
                n_y = FloatOf(&bracket->n_y, pixel);
    const float4 across =
        (float4)(FloatOf(&stencils->across[0], pixel), FloatOf(&stencils->across[1], pixel),
                 FloatOf(&stencils->across[2], pixel), FloatOf(&stencils->across[3], pixel));
    __global const float* first = coefficients + ((const int*)&stencils->offset)[pixel];
    for (int channel = 0; channel < channels; ++channel, first += 3 * table.size) {
      float4 b0 = 0.0f, b1_u = 0.0f, b1_v = 0.0f;
#pragma unroll
      for (int i = 0; i < 4; ++i)
#pragma unroll
        for (int j = 0; j < 4; ++j) {
          __global const float* row = first + (i * table.slice + j * table.line);
          const float4 weight = FloatOf(&stencils->rows[4 * i + j], pixel);
          b0 = fma(weight, vload4(0, row), b0);
          b1_u = fma(weight, vload4(0, row + table.size), b1_u);
          b1_v = fma(weight, vload4(0, row + 2 * table.size), b1_v);
        }
      ((float*)&sum[channel])[pixel] +=
          dot(across, fma((float4)(height), b0, fma((float4)(n_x), b1_u, n_y * b1_v)));
    }
  }
}

static inline int CountOf(int16 mask) {
  const int8 a = mask.lo + mask.hi;
  const int4 b = a.lo + a.hi;
  const int2 c = b.lo + b.hi;
  return -(c.x + c.y);
}

// True if the pixels that are wanted have the bracket of `lane` up to rounding, as those of a plane do.
static inline bool IsPlane(const Bracket* bracket, int lane, float16 rounding, int16 wanted) {
  return !AnyOf(wanted & (fabs(bracket->height - FloatOf(&bracket->height, lane)) > rounding |
                          fabs(bracket->n_x - FloatOf(&bracket->n_x, lane)) > 1e-6f |
                          fabs(bracket->n_y - FloatOf(&bracket->n_y, lane)) > 1e-6f));
}

// height B0 + n_x B1_u + n_y B1_v of every channel and of the pixels that are wanted.
static inline void InterpolateAll(__global const float* coefficients, TableLayout table,
                                  const Stencils* stencils, const Bracket* bracket,
                                  float16 rounding, int16 wanted, int channels, float16 sum[3]) {
  for (int channel = 0; channel < 3; ++channel) sum[channel] = 0.0f;
  int lane = 0;
  while (!((const int*)&wanted)[lane]) ++lane;
  const bool plane = IsPlane(bracket, lane, rounding, wanted);
  SharedStencils shared;
  for (int16 left = wanted; AnyOf(left);) {
    const int16 taken = TakeShared(stencils, &left, &shared);
    __global const float* first = coefficients + shared.offset;
    if (CountOf(taken) < kFewestToShare)
      AddEach(coefficients, table, stencils, bracket, taken, channels, sum);
    else if (plane && channels == 3)
      AddSharedPlane(first, table, &shared, stencils->rows, bracket, lane, 3, sum);
    else if (plane)
      AddSharedPlane(first, table, &shared, stencils->rows, bracket, lane, 1, sum);
    else if (channels == 3)
      AddShared(first, table, &shared, stencils->rows, bracket, 3, sum);
    else
      AddShared(first, table, &shared, stencils->rows, bracket, 1, sum);
  }
}

// Of the light that reaches a pixel; `share` (may be null: all of it) is that of patch_shares.cl.
static inline float ShareOf(__global const float* share, int pixel) {
  return share ? share[pixel] : 1.0f;
}

// UnclippedError of kPixels receivers.
static inline float16 UnclippedErrors(__constant const LuminaireParams* luminaire, Vectors n,
                                      float16 z, float16 shrink) {
  const float h = luminaire->axis[0].spacing.hi;
  return (fabs(n.x) * fabs(1.0f / luminaire->axis[0].step.hi) +
          fabs(n.y) * fabs(1.0f / luminaire->axis[1].step.hi)) *
         h / (8.0f * z * shrink);
}

// left[0] pixels of `by_exact` from left[2] on, left[1] of `unclipped` from the end down, as ~pixel
// those that also are `tabulated`.
static inline void ListLeft(int16 by_exact, int16 unclipped, int16 tabulated, int first,
                            int pixel_count, __global int* left) {
  const int *exact = (const int*)&by_exact, *fine = (const int*)&unclipped,
            *whole = (const int*)&tabulated;
  for (int k = 0; k < kPixels; ++k) {
    if (exact[k]) left[2 + atomic_inc(left)] = first + k;
    if (fine[k]) left[1 + pixel_count - atomic_inc(left + 1)] = whole[k] ? ~(first + k) : first + k;
  }
}

// Adds `e` of every channel to kPixels pixels.
static inline void AddToPixels(const float16* e, int channels, int first, int count,
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
                               __global const float* coefficients, __global const float4* positions,
                               __global const float4* normals, int pixel_count,
                               __global const float4* ratio, __global float4* irradiance,
                               __global float* variance, __global int* left, float max_error,
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
  const Vectors n = DirectionsInFrame(luminaire, LoadVectors(normals, first, pixel_count, &unused));
  const float16 height = -fma(n.x, x, fma(n.y, y, n.z * z));
  const float16 spread = fabs(n.x) * volume->extent[0] + fabs(n.y) * volume->extent[1];
  lit &= height + spread > 0.0f;
  const float16 rounding = 1e-6f * (fabs(x) + fabs(y) + z);
  const int16 cut = lit & (height - spread < rounding),
              unclipped = cut & (UnclippedErrors(luminaire, n, z, shrink) <= max_error);
  const float16 at_x = Position(&volume->axis[0], a_x), at_y = Position(&volume->axis[1], a_y),
                at_tau = Position(&volume->axis[2], tau);
  // With shares of rays a pixel is lit once: its variance grows with the square of its light.
  const int16 from_behind = ratio ? (int16)(0) : unclipped & (height > 0.0f);
  const int16 tabulated = lit & (~cut | from_behind) & IsInside(&volume->axis[0], at_x) &
                          IsInside(&volume->axis[1], at_y) & IsInside(&volume->axis[2], at_tau),
              by_exact = lit & ~unclipped & ~tabulated;
  if (AnyOf(unclipped | by_exact))
    ListLeft(by_exact, unclipped, tabulated, first, pixel_count, left);
  if (!coefficients || !AnyOf(tabulated)) return;

  Stencils stencils;
  MakeStencils(volume, Covered(&volume->axis[0], at_x), Covered(&volume->axis[1], at_y),
               Covered(&volume->axis[2], at_tau), &stencils);
  const int line = volume->axis[0].coefficients, slice = line * volume->axis[1].coefficients;
  const TableLayout table = {line, slice, (size_t)slice * volume->axis[2].coefficients};
  const float16 scale = select((float16)(0.0f), seen * tau * tau / z, tabulated);
  const Bracket bracket = {height, n.x, n.y};
  float16 e[3];
  InterpolateAll(coefficients, table, &stencils, &bracket, rounding, tabulated, luminaire->channels,
                 e);
  for (int channel = 0; channel < luminaire->channels; ++channel) e[channel] *= scale;
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
