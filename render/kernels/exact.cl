// Irradiance in closed form (THEORY.md 7.1, F-plane form):
//
//   E_m = delta^2 / z^3 h^2 sum_rc C_m(r, c) (k X0_c Y0_r + n_x h X1_c Y0_r + n_y h X0_c Y1_r),
//   k = n . (centre of the support on F - p)
//
// with the texel weights X, Y of texel_weights.clh. A work-item lights PIXELS neighbouring pixels,
// which read a window while it is in the cache, SHARED of them from the same loads. Windows are
// walked in chunks of 32 columns and kRows rows, so any size fits.
#include "kernels/horizon.clh"
#include "kernels/texel_weights.clh"

enum { kRows = 32, kColumns = 32, kBasisRows = 12 };

typedef struct Tile {
  Receiver receiver[PIXELS];
  Axis axis[2][PIXELS];
  bool live[PIXELS];
} Tile;

// Texels that basis function `i` needs, joined over pixels [begin, end) of the tile.
inline int2 JoinedTexels(__constant const LuminaireParams* luminaire, const Tile* tile,
                         int dimension, int i, int begin, int end) {
  int2 joined = (int2)(luminaire->axis[dimension].texels, 0);
  for (int k = begin; k < end; ++k) {
    if (!tile->live[k]) continue;
    const Axis* axis = &tile->axis[dimension][k];
    const int2 range = WindowTexels(MakeKnot(axis, i), MakeKnot(axis, i + luminaire->basis.cells),
                                    luminaire->axis[dimension].texels);
    joined = (int2)(min(joined.x, range.x), max(joined.y, range.y));
  }
  return joined;
}

// True if lighting the live pixels together touches at most half as many texels again as the
// smallest of their windows needs: they see nearly the same.
inline bool SharesWindows(__constant const LuminaireParams* luminaire, const Tile* tile) {
  for (int dimension = 0; dimension < 2; ++dimension) {
    const int middle = luminaire->axis[dimension].count / 2;
    const int2 joined = JoinedTexels(luminaire, tile, dimension, middle, 0, PIXELS);
    for (int k = 0; k < PIXELS; ++k) {
      if (!tile->live[k]) continue;
      const int2 own = JoinedTexels(luminaire, tile, dimension, middle, k, k + 1);
      if (2 * (joined.y - joined.x) > 3 * (own.y - own.x) + 8) return false;
    }
  }
  return true;
}

inline float AxisCentre(__constant const LuminaireParams* luminaire, const Axis* axis,
                        int dimension, int i) {
  return axis->offset +
         ((float)i + 0.5f * (float)luminaire->basis.cells) * luminaire->axis[dimension].spacing.hi;
}

// Adds sum_m E_m / (delta^2 / z^3 h^2) of pixels [begin, end) to `sum`, lane by lane, per pixel and
// channel.
inline void LightPixels(__constant const LuminaireParams* luminaire, __global const float* images,
                        const Tile* tile, int begin, int end, Lanes sum[PIXELS][3]) {
  __constant const BasisParams* basis = &luminaire->basis;
  const int columns = luminaire->axis[0].count, rows = luminaire->axis[1].count;
  const size_t plane = (size_t)luminaire->axis[1].texels * luminaire->row_stride;
  const float h = luminaire->axis[0].spacing.hi;
  float y0[kBasisRows][PIXELS][kRows], y1[kBasisRows][PIXELS][kRows];
  int2 row_range[kBasisRows];
  for (int j_begin = 0; j_begin < rows; j_begin += kBasisRows) {
    const int j_end = min(j_begin + kBasisRows, rows);
    for (int row_chunk = 0;; ++row_chunk) {
      bool any = false;
      for (int j = j_begin; j < j_end; ++j) {
        int2 range = JoinedTexels(luminaire, tile, 1, j, begin, end);
        range.x += row_chunk * kRows;
        range.y = min(range.y, range.x + kRows);
        row_range[j - j_begin] = range;
        if (range.x >= range.y) continue;
        any = true;
        for (int k = 0; k < PIXELS; ++k)
          for (int half_chunk = 0; half_chunk < 2; ++half_chunk) {
            Lanes zeroth = 0.0f, moment = 0.0f;
            if (k >= begin && k < end && tile->live[k] && range.x + 16 * half_chunk < range.y)
              TexelWeights(basis, &tile->axis[1][k], j, (float)(range.x + 16 * half_chunk), &zeroth,
                           &moment);
            vstore16(zeroth, half_chunk, y0[j - j_begin][k]);
            vstore16(moment, half_chunk, y1[j - j_begin][k]);
          }
      }
      if (!any) break;
      for (int i = 0; i < columns; ++i) {
        const int2 column_range = JoinedTexels(luminaire, tile, 0, i, begin, end);
        for (int c = column_range.x; c < column_range.y; c += kColumns) {
          Lanes x0[PIXELS][2], x1[PIXELS][2];
          for (int k = 0; k < PIXELS; ++k)
            for (int half_chunk = 0; half_chunk < 2; ++half_chunk) {
              x0[k][half_chunk] = x1[k][half_chunk] = 0.0f;
              if (k >= begin && k < end && tile->live[k] && c + 16 * half_chunk < column_range.y)
                TexelWeights(basis, &tile->axis[0][k], i, (float)(c + 16 * half_chunk),
                             &x0[k][half_chunk], &x1[k][half_chunk]);
            }
          for (int j = j_begin; j < j_end; ++j) {
            const int2 range = row_range[j - j_begin];
            if (range.x >= range.y) continue;
            for (int channel = 0; channel < luminaire->channels; ++channel) {
              __global const float* window =
                  images + ((size_t)(j * columns + i) * luminaire->channels + channel) * plane +
                  (size_t)range.x * luminaire->row_stride + c;
              for (int first = 0; first < PIXELS; first += SHARED) {
                __global const float* texel = window;
                Lanes a0[SHARED], b0[SHARED], a1[SHARED], b1[SHARED];
#pragma unroll
                for (int k = 0; k < SHARED; ++k) a0[k] = b0[k] = a1[k] = b1[k] = 0.0f;
                for (int r = 0; r < range.y - range.x; ++r) {
                  const Lanes a = vload16(0, texel), b = vload16(1, texel);
                  texel += luminaire->row_stride;
#pragma unroll
                  for (int k = 0; k < SHARED; ++k) {
                    const float weight0 = y0[j - j_begin][first + k][r],
                                weight1 = y1[j - j_begin][first + k][r];
                    a0[k] = fma(a, (Lanes)(weight0), a0[k]);
                    b0[k] = fma(b, (Lanes)(weight0), b0[k]);
                    a1[k] = fma(a, (Lanes)(weight1), a1[k]);
                    b1[k] = fma(b, (Lanes)(weight1), b1[k]);
                  }
                }
#pragma unroll
                for (int k = 0; k < SHARED; ++k) {
                  const int pixel = first + k;
                  if (pixel < begin || pixel >= end || !tile->live[pixel]) continue;
                  const float3 n = tile->receiver[pixel].normal;
                  const float centre = n.x * AxisCentre(luminaire, &tile->axis[0][pixel], 0, i) +
                                       n.y * AxisCentre(luminaire, &tile->axis[1][pixel], 1, j) -
                                       n.z * tile->receiver[pixel].p.z;
                  sum[pixel][channel] += x0[pixel][0] * (centre * a0[k] + (n.y * h) * a1[k]) +
                                         (n.x * h) * x1[pixel][0] * a0[k] +
                                         x0[pixel][1] * (centre * b0[k] + (n.y * h) * b1[k]) +
                                         (n.x * h) * x1[pixel][1] * b0[k];
                }
              }
            }
          }
        }
      }
    }
  }
}

// Adds the irradiance of every pixel whose horizon does not cut the luminaire. `ratio` (may be
// null): visible share per channel and the variance of the luminance share.
__kernel void ExactIrradiance(__constant const LuminaireParams* luminaire,
                              __global const float* images, __global const float4* positions,
                              __global const float4* normals, int pixel_count,
                              __global const float4* ratio, __global float4* irradiance,
                              __global float* variance) {
  const int first = get_global_id(0) * PIXELS;
  if (first >= pixel_count) return;
  Tile tile;
  Lanes sum[PIXELS][3];
  bool any = false;
  for (int k = 0; k < PIXELS; ++k) {
    for (int channel = 0; channel < 3; ++channel) sum[k][channel] = 0.0f;
    const int pixel = min(first + k, pixel_count - 1);
    const float4 position = positions[pixel];
    tile.receiver[k] = MakeReceiver(luminaire, position.xyz, normals[pixel].xyz);
    tile.live[k] = first + k < pixel_count && position.w != 0.0f && tile.receiver[k].p.z > 0.0f;
    if (!tile.live[k]) continue;
    const float3 p = tile.receiver[k].p;
    tile.axis[0][k] = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
    tile.axis[1][k] = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
    tile.live[k] =
        WholeHorizon(luminaire, &tile.receiver[k], &tile.axis[0][k], &tile.axis[1][k]) == kAbove;
    any |= tile.live[k];
  }
  if (!any) return;
  if (SharesWindows(luminaire, &tile)) {
    LightPixels(luminaire, images, &tile, 0, PIXELS, sum);
  } else {
    for (int k = 0; k < PIXELS; ++k)
      if (tile.live[k]) LightPixels(luminaire, images, &tile, k, k + 1, sum);
  }
  for (int k = 0; k < PIXELS; ++k) {
    if (!tile.live[k]) continue;
    const float total[3] = {SumLanes(sum[k][0]), SumLanes(sum[k][1]), SumLanes(sum[k][2])};
    AddIrradiance(luminaire, tile.receiver[k].p.z, total, first + k, ratio, irradiance, variance);
  }
}

// The same for the pixels whose horizon does: texel by texel, cut texels clipped and integrated
// exactly.
__kernel void ExactCutIrradiance(__constant const LuminaireParams* luminaire,
                                 __global const float* images, __global const float4* positions,
                                 __global const float4* normals, int pixel_count,
                                 __global const float4* ratio, __global float4* irradiance,
                                 __global float* variance) {
  const int pixel = get_global_id(0);
  if (pixel >= pixel_count || positions[pixel].w == 0.0f) return;
  const Receiver receiver = MakeReceiver(luminaire, positions[pixel].xyz, normals[pixel].xyz);
  if (!(receiver.p.z > 0.0f)) return;
  const Axis x = MakeAxis(&luminaire->axis[0], luminaire->delta, receiver.p.x, receiver.p.z);
  const Axis y = MakeAxis(&luminaire->axis[1], luminaire->delta, receiver.p.y, receiver.p.z);
  if (WholeHorizon(luminaire, &receiver, &x, &y) != kCut) return;
  float sum[3] = {0.0f, 0.0f, 0.0f};
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i)
      LightCutImage(luminaire, images, &receiver, &x, &y, i, j, sum);
  AddIrradiance(luminaire, receiver.p.z, sum, pixel, ratio, irradiance, variance);
}
