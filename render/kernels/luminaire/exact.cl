// Irradiance in closed form (docs/theory.md 7.1, F-plane form). n . (u - p) = g_x(u) + g_y(v), so
// every image separates into two products of texel weights along the axes:
//
//   E_m = delta^2 / z^3 h^2 sum_rc C_m(r, c) (X_c Gy_r + Gx_c Y_r)
//   X_c = integral B_i du,   Gx_c = integral g_x B_i du
//
// over what texel column c sees, Y and Gy likewise for rows (texel_weights.clh):
// two multiply-adds per texel, the least there is. A work-item lights PIXELS neighbouring pixels,
// SHARED of them from the same loads of texels where they see nearly the same windows. Windows are
// walked in chunks of kChunk x kChunk texels and kBasis x kBasis images, so any size fits.
#include "luxfield/render/kernels/luminaire/cut_horizon.clh"
#include "luxfield/render/kernels/luminaire/texel_weights.clh"

enum { kBasis = SHARED > 1 ? 12 : 4 };

typedef struct Pixel {
  int index;
  Receiver receiver;
  Axis axis[2];
} Pixel;

// The first and the last texel that knot q lies in, over the pixels.
static inline int2 KnotTexels(const Pixel* pixels, int count, int dimension, int q) {
  int2 texels = AxisTexel(&pixels[0].axis[dimension], q);
  for (int k = 1; k < count; ++k) {
    const int texel = AxisTexel(&pixels[k].axis[dimension], q);
    texels = (int2)(min(texels.x, texel), max(texels.y, texel));
  }
  return texels;
}

// Texels that the pixels see between two knots, together.
static inline int2 JoinedTexels(int2 knot_a, int2 knot_b, int texels) {
  return TexelsBetween(min(knot_a.x, knot_b.x), max(knot_a.y, knot_b.y), texels);
}

// True if lighting the pixels together touches at most half as many texels again as the smallest of
// their windows needs: they see nearly the same.
static inline bool ShareWindows(__constant const LuminaireParams* luminaire, const Pixel* pixels,
                                int count) {
  for (int dimension = 0; dimension < 2; ++dimension) {
    const int middle = luminaire->axis[dimension].count / 2, end = middle + luminaire->basis.cells,
              texels = luminaire->axis[dimension].texels;
    const int2 joined = JoinedTexels(KnotTexels(pixels, count, dimension, middle),
                                     KnotTexels(pixels, count, dimension, end), texels);
    for (int k = 0; k < count; ++k) {
      const int2 own = AxisTexels(&pixels[k].axis[dimension], middle, end, texels);
      if (2 * (joined.y - joined.x) > 3 * (own.y - own.x) + 8) return false;
    }
  }
  return true;
}

// The texels that the pixels see through `count` basis functions from `first` on, together.
// Returns the number of chunks of kChunk texels that the longest of these windows takes.
static inline int JoinedWindows(__constant const LuminaireParams* luminaire, const Pixel* pixels,
                                int pixel_count, int dimension, int first, int count,
                                int2 windows[kBasis]) {
  const int cells = luminaire->basis.cells;
  int2 knots[kBasis + kMaxCells];
  for (int q = 0; q < count + cells; ++q)
    knots[q] = KnotTexels(pixels, pixel_count, dimension, first + q);
  int longest = 0;
  for (int i = 0; i < count; ++i) {
    windows[i] = JoinedTexels(knots[i], knots[i + cells], luminaire->axis[dimension].texels);
    longest = max(longest, windows[i].y - windows[i].x);
  }
  return (longest + kChunk - 1) / kChunk;
}

// Weights of `count` basis functions from `first` on for the `chunk`-th kChunk texels of their
// windows, per pixel.
static inline void MakeBlock(__constant const LuminaireParams* luminaire, const Pixel* pixels,
                             int pixel_count, int dimension, int first, int count,
                             const int2 windows[kBasis], int chunk,
                             TexelWeights weights[SHARED][kBasis]) {
  for (int k = 0; k < pixel_count; ++k) {
    for (int i = 0; i < count; ++i) {
      const int begin = windows[i].x + chunk * kChunk;
      weights[k][i].range = (int2)(begin, clamp(windows[i].y, begin, begin + kChunk));
    }
    const Axis* axis = &pixels[k].axis[dimension];
    MakeTexelWeights(&luminaire->basis, *axis,
                     LineAlong(luminaire, &pixels[k].receiver, axis, dimension), first, count,
                     weights[k]);
  }
}

// sum_r C(r, c) Y_r and sum_r C(r, c) Gy_r of up to kChunk columns.
typedef struct Sums {
  Lanes zeroth[kVectors], facing[kVectors];
} Sums;

// What is seen of an image: share[pixel][row of the grid], where there are shadow maps.
#if SHADOW_MAPS
#define SHARE(k, j) share[k][j]
#else
#define SHARE(k, j) 1.0f
#endif

__attribute__((always_inline)) static inline void AddRow(const Lanes* texels,
                                                         const TexelWeights* rows, float share,
                                                         int r, const int vectors, Sums* sums) {
  const Lanes y = share * Zeroth(rows)[r], g = share * Facing(rows)[r];
#pragma unroll
  for (int v = 0; v < vectors; ++v) {
    sums->zeroth[v] = fma(texels[v], y, sums->zeroth[v]);
    sums->facing[v] = fma(texels[v], g, sums->facing[v]);
  }
}

__attribute__((always_inline)) static inline Lanes AcrossColumns(const Sums* sums,
                                                                 const TexelWeights* columns,
                                                                 const int vectors) {
  Lanes sum = 0.0f;
#pragma unroll
  for (int v = 0; v < vectors; ++v)
    sum += columns->zeroth[v + 1] * sums->facing[v] + columns->facing[v + 1] * sums->zeroth[v];
  return sum;
}

// Adds one channel of `count` images above each other to `sum`, per pixel: columns `i` of the
// weights, `vectors` Lanes wide. The compiler knows `pixels` and `vectors`.
__attribute__((always_inline)) static inline void LightColumn(
    __global const float* image, size_t image_stride, int row_stride,
    TexelWeights columns[SHARED][kBasis], int i, TexelWeights rows[SHARED][kBasis],
    const float share[SHARED][kBasis], int count, const int pixels, const int vectors, Lanes* sum) {
  Sums s0 = {0}, s1 = {0}, s2 = {0}, s3 = {0};
  for (int j = 0; j < count; ++j, image += image_stride) {
    const int2 range = rows[0][j].range;
    __global const float* texel = image + (size_t)range.x * row_stride;
    for (int r = 0; r < range.y - range.x; ++r, texel += row_stride) {
      Lanes texels[kVectors];
#pragma unroll
      for (int v = 0; v < vectors; ++v) texels[v] = LoadLanes(texel + v * kLanes);
      AddRow(texels, &rows[0][j], SHARE(0, j), r, vectors, &s0);
      if (pixels > 1) AddRow(texels, &rows[1][j], SHARE(1, j), r, vectors, &s1);
      if (pixels > 2) {
        AddRow(texels, &rows[2][j], SHARE(2, j), r, vectors, &s2);
        AddRow(texels, &rows[3][j], SHARE(3, j), r, vectors, &s3);
      }
    }
  }
  sum[0] += AcrossColumns(&s0, &columns[0][i], vectors);
  if (pixels > 1) sum[1] += AcrossColumns(&s1, &columns[1][i], vectors);
  if (pixels > 2) {
    sum[2] += AcrossColumns(&s2, &columns[2][i], vectors);
    sum[3] += AcrossColumns(&s3, &columns[3][i], vectors);
  }
}

// Adds one channel of sum_m E_m / (delta^2 / z^3 h^2) to `sum`, lane by lane, per pixel.
__attribute__((always_inline)) static inline void LightPixels(
    __constant const LuminaireParams* luminaire, __global const float* images,
    __global const uint* seen, const Pixel* pixels, const int count, int channel, Lanes* sum) {
  const int width = luminaire->axis[0].count, height = luminaire->axis[1].count;
  const int channels = luminaire->channels, row_stride = luminaire->row_stride;
  const size_t plane = (size_t)luminaire->axis[1].texels * row_stride;
  const size_t image_stride = width * channels * plane;
  TexelWeights columns[SHARED][kBasis], rows[SHARED][kBasis];
  float share[SHARED][kBasis];
  for (int j_begin = 0; j_begin < height; j_begin += kBasis)
    for (int i_begin = 0; i_begin < width; i_begin += kBasis) {
      const int j_count = min((int)kBasis, height - j_begin),
                i_count = min((int)kBasis, width - i_begin);
      int2 across[kBasis], down[kBasis];
      const int column_chunks =
                    JoinedWindows(luminaire, pixels, count, 0, i_begin, i_count, across),
                row_chunks = JoinedWindows(luminaire, pixels, count, 1, j_begin, j_count, down);
      for (int c = 0; c < column_chunks; ++c) {
        MakeBlock(luminaire, pixels, count, 0, i_begin, i_count, across, c, columns);
        for (int r = 0; r < row_chunks; ++r) {
          MakeBlock(luminaire, pixels, count, 1, j_begin, j_count, down, r, rows);
          for (int i = 0; i < i_count; ++i) {
            const int2 range = columns[0][i].range;
#if SHADOW_MAPS
            for (int k = 0; k < count; ++k)
              for (int j = 0; j < j_count; ++j)
                share[k][j] =
                    ImageVisibility(luminaire, SeenByPixel(luminaire, seen, pixels[k].index),
                                    i_begin + i, j_begin + j);
#endif
            __global const float* image =
                images + ((size_t)(j_begin * width + i_begin + i) * channels + channel) * plane +
                range.x;
#define LIGHT_COLUMN(vectors)                                                                    \
  LightColumn(image, image_stride, row_stride, columns, i, rows, share, j_count, count, vectors, \
              sum)
            switch ((range.y - range.x + kLanes - 1) / kLanes) {
              case 1:
                LIGHT_COLUMN(1);
                break;
              case 2:
                LIGHT_COLUMN(2);
                break;
#if LANES < 16
              case 3:
                LIGHT_COLUMN(3);
                break;
#endif
#if LANES < 8
              case 4:
                LIGHT_COLUMN(4);
                break;
              case 5:
                LIGHT_COLUMN(5);
                break;
              case 6:
                LIGHT_COLUMN(6);
                break;
#endif
            }
          }
        }
      }
    }
}

// Adds the irradiance of every pixel whose horizon does not cut the luminaire. `ratio` (may be
// null): what of it is visible (estimators/visible_share.h). `seen`: the cells that shadow maps
// show; null unless SHADOW_MAPS.
//
// Work-items light runs of PIXELS pixels of a row and follow each other down `tile_rows` rows, then
// along them: what neighbouring rows see is still in a core's cache.
__kernel void ExactIrradiance(__constant const LuminaireParams* luminaire,
                              __global const float* images, __global const float4* positions,
                              __global const float4* normals, int width, int height, int tile_rows,
                              __global const float4* ratio, __global const uint* seen,
                              __global float4* irradiance, __global float* variance) {
  const int tile_items = tile_rows * ((width + PIXELS - 1) / PIXELS), item = get_global_id(0),
            in_tile = item % tile_items;
  const int row = item / tile_items * tile_rows + in_tile % tile_rows,
            column = in_tile / tile_rows * PIXELS;
  if (row >= height) return;
  const int first = row * width + column, end_of_run = row * width + min(column + PIXELS, width);
  Pixel pixels[PIXELS];
  int count = 0;
  for (int index = first; index < end_of_run; ++index) {
    if (positions[index].w == 0.0f) continue;
    Pixel pixel;
    pixel.index = index;
    pixel.receiver = MakeReceiver(luminaire, positions[index].xyz, normals[index].xyz);
    const float3 p = pixel.receiver.p;
    if (!(p.z > 0.0f) || WholeHorizon(luminaire, &pixel.receiver) != kAbove) continue;
    pixel.axis[0] = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
    pixel.axis[1] = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
    pixels[count++] = pixel;
  }
  float sum[PIXELS][3] = {{0.0f}};
  // Channel by channel: the windows of one stay in a core's cache from group to group.
  for (int channel = 0; channel < luminaire->channels; ++channel)
    for (int begin = 0; begin < count; begin += SHARED) {
      const int end = min(begin + SHARED, count);
      if (SHARED > 1 && end - begin == SHARED && ShareWindows(luminaire, pixels + begin, SHARED)) {
        Lanes lanes[SHARED] = {0};
        LightPixels(luminaire, images, seen, pixels + begin, SHARED, channel, lanes);
        for (int k = begin; k < end; ++k) sum[k][channel] = SumLanes(lanes[k - begin]);
      } else {
        for (int k = begin; k < end; ++k) {
          Lanes lanes = 0.0f;
          LightPixels(luminaire, images, seen, pixels + k, 1, channel, &lanes);
          sum[k][channel] = SumLanes(lanes);
        }
      }
    }
  for (int k = 0; k < count; ++k)
    AddIrradiance(luminaire, pixels[k].receiver.p.z, sum[k], pixels[k].index, ratio, irradiance,
                  variance);
}

// The same for the pixels whose horizon does, cut texels clipped and integrated exactly.
__kernel void ExactCutIrradiance(__constant const LuminaireParams* luminaire,
                                 __global const float* images, __global const float4* positions,
                                 __global const float4* normals, int pixel_count,
                                 __global const float4* ratio, __global const uint* seen,
                                 __global float4* irradiance, __global float* variance) {
  const int pixel = get_global_id(0);
  if (pixel >= pixel_count || positions[pixel].w == 0.0f) return;
  const Receiver receiver = MakeReceiver(luminaire, positions[pixel].xyz, normals[pixel].xyz);
  if (!(receiver.p.z > 0.0f) || WholeHorizon(luminaire, &receiver) != kCut) return;
  float sum[3];
  LightCutPixel(luminaire, images, &receiver, SeenByPixel(luminaire, seen, pixel), /*clip=*/true,
                sum);
  AddIrradiance(luminaire, receiver.p.z, sum, pixel, ratio, irradiance, variance);
}
