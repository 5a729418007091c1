// Windowed importance sampling (THEORY.md 6): images are allotted samples in proportion to the mass
// of their windows, points in a window are drawn with density C / mass.
//
//   E = delta^2 / z^3 h^2 sum_m M_m / nbar_m sum_k c Phi_m(y_k) (n . (u_k - p))+ V,   K_m of
//   expectation nbar_m
#include "kernels/bvh.clh"
#include "kernels/random.clh"
#include "kernels/sampling_types.clh"
#include "kernels/window_sampling.clh"

// The number of samples below cumulative expectation `sum`, floor(sum + xi), without rounding of
// the addition.
inline int SamplesBelow(float sum, float xi) {
  const float whole = floor(sum);
  return (int)whole + ((sum - whole) + xi >= 1.0f ? 1 : 0);
}

typedef struct Totals {
  float3 light;                  // sum of all contributions, visibility aside
  float3 visible;                // sum of the visible ones
  float square, visible_square;  // sums of squared luminance
  int count;
} Totals;

inline float Luminance(float3 c) { return dot(c, (float3)(0.2126f, 0.7152f, 0.0722f)); }

typedef struct Surface {
  float3 position, normal;  // world
  Receiver receiver;        // luminaire frame
  Axis x, y;
} Surface;

typedef struct Scene {
  __global const BvhNode* nodes;  // null: no shadows
  __global const BvhTriangle* triangles;
} Scene;

// What one sample of image m adds, per unit of `weight` = M_m / nbar_m.
inline void AddSample(__constant const LuminaireParams* luminaire, __global const float* images,
                      const Surface* surface, Scene scene, int m, int i, int j, WindowSample sample,
                      float weight, Totals* totals) {
  const float h = luminaire->axis[0].spacing.hi;
  const float3 to_lamp =
      (float3)(surface->x.offset + ((float)i + sample.y.x) * h,
               surface->y.offset + ((float)j + sample.y.y) * h, -surface->receiver.p.z);
  const float cosine = dot(surface->receiver.normal, to_lamp);
  ++totals->count;
  if (!(cosine > 0.0f)) return;
  float3 light = weight * cosine * BasisValue(&luminaire->basis, sample.y.x) *
                 BasisValue(&luminaire->basis, sample.y.y);
  if (luminaire->channels == 3) {
    const size_t plane = (size_t)luminaire->axis[1].texels * luminaire->row_stride;
    __global const float* texel =
        images + (size_t)m * 3 * plane + (size_t)sample.row * luminaire->row_stride + sample.column;
    const float3 rgb = (float3)(texel[0], texel[plane], texel[2 * plane]);
    const float y = Luminance(rgb);
    light *= y > 0.0f ? rgb / y : (float3)(0.0f);
  }
  const float luminance = Luminance(light);
  totals->light += light;
  totals->square += luminance * luminance;
  if (scene.nodes) {
    __constant const float* r = luminaire->rotation;
    const float3 world = surface->position + to_lamp.x * (float3)(r[0], r[1], r[2]) +
                         to_lamp.y * (float3)(r[3], r[4], r[5]) +
                         to_lamp.z * (float3)(r[6], r[7], r[8]);
    if (Shadowed(scene.nodes, scene.triangles, surface->position, surface->normal, world)) return;
  }
  totals->visible += light;
  totals->visible_square += luminance * luminance;
}

// Window masses of all images into scratch[m * stride]; returns their sum.
inline float WindowMasses(__constant const LuminaireParams* luminaire, __global const ulong* sat,
                          __global const float* sat_scale, const Surface* surface,
                          __global float* scratch, int stride) {
  const int columns = luminaire->axis[0].texels, rows = luminaire->axis[1].texels;
  const size_t sat_size = (size_t)(columns + 1) * (rows + 1);
  float total = 0.0f;
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j) {
    const Span row_span = MakeSpan(&surface->y, j, luminaire->basis.cells, rows);
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const Span column_span = MakeSpan(&surface->x, i, luminaire->basis.cells, columns);
      const float mass =
          WindowMass(sat + m * sat_size, columns + 1, column_span, row_span) * sat_scale[m];
      scratch[(size_t)m * stride] = mass;
      total += mass;
    }
  }
  return total;
}

inline Totals LightWindowed(__constant const LuminaireParams* luminaire,
                            __constant const SamplingParams* sampling, __global const float* images,
                            __global const ulong* sat, __global const float* sat_scale,
                            const Surface* surface, Scene scene, uint pixel,
                            __global float* scratch) {
  Totals totals = {(float3)(0.0f), (float3)(0.0f), 0.0f, 0.0f, 0};
  const int stride = sampling->scratch_stride;
  const float total = WindowMasses(luminaire, sat, sat_scale, surface, scratch, stride);
  if (!(total > 0.0f)) return totals;
  const int columns = luminaire->axis[0].texels, rows = luminaire->axis[1].texels,
            cells = luminaire->basis.cells;
  const size_t sat_size = (size_t)(columns + 1) * (rows + 1);
  const uint4 bits = Philox((uint4)(pixel, 0u, sampling->stream, 0u),
                            (uint2)(sampling->seed_lo, sampling->seed_hi));
  const float xi = UnitFloat(bits.x);
  const float wanted = (float)sampling->samples;
  const float largest =
      sampling->max_per_image > 0.0f ? total * (sampling->max_per_image / wanted) : INFINITY;
  const float per_mass = wanted / total;
  float sum = 0.0f;
  int below = 0, m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const float mass = scratch[(size_t)m * stride];
      const float counted = fmin(mass, largest);
      sum += counted;  // unclamped, the last sum is `total` to the bit: exactly K samples
      const int end = SamplesBelow(wanted * (sum / total), xi);
      const int count = end - below;
      below = end;
      if (count <= 0 || !(mass > 0.0f)) continue;
      const Span row_span = MakeSpan(&surface->y, j, cells, rows);
      const Span column_span = MakeSpan(&surface->x, i, cells, columns);
      const uint2 shift =
          (uint2)(Mix(bits.y + 0x9E3779B9u * (uint)m), Mix(bits.z + 0x85EBCA6Bu * (uint)m));
      const Prefix marginal = ColumnPrefix(sat + m * sat_size, columns + 1, column_span, row_span);
      const float weight = mass == counted ? 1.0f / per_mass : mass / (counted * per_mass);
      for (int k = 0; k < count; ++k) {
        const WindowSample sample =
            SampleWindow(sat + m * sat_size, columns + 1, &surface->x, &surface->y, &marginal,
                         column_span, row_span, (float)cells, ShiftedSequence((uint)k, shift));
        AddSample(luminaire, images, surface, scene, m, i, j, sample, weight, &totals);
      }
    }
  return totals;
}

// The estimator as printed in the thesis, 4.14 to 4.18: the marginal was integrated over all t
// before it is restricted to the window, K_m = round(A_m / A K), and one Halton prefix serves every
// image and pixel. Biased (THEORY.md 6). The receiver's cosine, absent in print, is kept: without
// it the sum is no irradiance.
inline Totals LightThesis(__constant const LuminaireParams* luminaire,
                          __constant const SamplingParams* sampling, __global const float* images,
                          __global const ulong* sat, __global const float* sat_scale,
                          const Surface* surface, Scene scene, __global float* scratch) {
  Totals totals = {(float3)(0.0f), (float3)(0.0f), 0.0f, 0.0f, 0};
  const int stride = sampling->scratch_stride;
  const float total = WindowMasses(luminaire, sat, sat_scale, surface, scratch, stride);
  if (!(total > 0.0f)) return totals;
  const int columns = luminaire->axis[0].texels, rows = luminaire->axis[1].texels,
            cells = luminaire->basis.cells;
  const size_t sat_size = (size_t)(columns + 1) * (rows + 1);
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const float mass = scratch[(size_t)m * stride];
      float share = rint(mass / total * (float)sampling->samples);
      if (sampling->max_per_image > 0.0f) share = fmin(share, rint(sampling->max_per_image));
      const int count = (int)share;
      if (count <= 0) continue;
      const Span row_span = MakeSpan(&surface->y, j, cells, rows);
      const Span column_span = MakeSpan(&surface->x, i, cells, columns);
      // The SAT's last row is cdf_m(s), its first row is zero: one band over the whole height.
      Prefix marginal;
      marginal.stride = 1;
      marginal.lower[0] = sat + m * sat_size;
      marginal.upper[0] = marginal.lower[0] + (size_t)rows * (columns + 1);
      marginal.weight[0] = 1.0f;
      SetMasses(&marginal, 1, column_span);
      for (int k = 0; k < count; ++k) {
        const Place column =
            InvertPrefix(&marginal, 1, column_span, RadicalInverse((uint)k + 1u, 2u));
        const Prefix conditional =
            RowPrefix(sat + m * sat_size, columns + 1, column.texel, row_span);
        const Place row = InvertPrefix(&conditional, 1, row_span, RadicalInverse((uint)k + 1u, 3u));
        WindowSample sample;
        sample.column = column.texel;
        sample.row = row.texel;
        sample.y = (float2)(SupportCoordinate(&surface->x, column_span, column, (float)cells),
                            SupportCoordinate(&surface->y, row_span, row, (float)cells));
        AddSample(luminaire, images, surface, scene, m, i, j, sample, mass / share, &totals);
      }
    }
  return totals;
}

inline bool MakeSurface(__constant const LuminaireParams* luminaire, float4 position, float4 normal,
                        Surface* surface) {
  if (position.w == 0.0f) return false;
  surface->position = position.xyz;
  surface->normal = normal.xyz;
  surface->receiver = MakeReceiver(luminaire, position.xyz, normal.xyz);
  const float3 p = surface->receiver.p;
  if (!(p.z > 0.0f)) return false;
  surface->x = MakeAxis(&luminaire->axis[0], luminaire->delta, p.x, p.z);
  surface->y = MakeAxis(&luminaire->axis[1], luminaire->delta, p.y, p.z);
  return true;
}

// delta^2 / z^3 h^2.
inline float FluxScale(__constant const LuminaireParams* luminaire, float z) {
  const float tau = luminaire->delta.hi / z, h = luminaire->axis[0].spacing.hi;
  return tau * tau * (h * h) / z;
}

// Variance of a sum of n contributions taken as independent; stratification only lowers it. One
// sample bounds it by its square.
inline float VarianceOfSum(float sum, float square, int n) {
  if (n < 2) return square;
  return fmax((square - sum * (sum / (float)n)) * ((float)n / (float)(n - 1)), 0.0f);
}

inline void StoreTotals(__constant const LuminaireParams* luminaire, const Surface* surface,
                        Totals totals, int pixel, __global float4* irradiance,
                        __global float* variance, __global uint* samples) {
  const float scale = FluxScale(luminaire, surface->receiver.p.z);
  irradiance[pixel].xyz += scale * totals.visible;
  variance[pixel] +=
      scale * scale * VarianceOfSum(Luminance(totals.visible), totals.visible_square, totals.count);
  samples[pixel] += (uint)totals.count;
}

#define SAMPLING_ARGUMENTS                                                                      \
  __constant const LuminaireParams *luminaire, __constant const SamplingParams *sampling,       \
      __global const float *images, __global const ulong *sat, __global const float *sat_scale, \
      __global const float4 *positions, __global const float4 *normals,                         \
      __global const BvhNode *nodes, __global const BvhTriangle *triangles,                     \
      __global float *scratch

__kernel void Windowed(SAMPLING_ARGUMENTS, __global float4* irradiance, __global float* variance,
                       __global uint* samples) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  Surface surface;
  if (pixel >= sampling->end || !MakeSurface(luminaire, positions[pixel], normals[pixel], &surface))
    return;
  const Scene scene = {nodes, triangles};
  const Totals totals = LightWindowed(luminaire, sampling, images, sat, sat_scale, &surface, scene,
                                      sampling->first_pixel + (uint)pixel, scratch + item);
  StoreTotals(luminaire, &surface, totals, pixel, irradiance, variance, samples);
}

__kernel void Thesis(SAMPLING_ARGUMENTS, __global float4* irradiance, __global float* variance,
                     __global uint* samples) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  Surface surface;
  if (pixel >= sampling->end || !MakeSurface(luminaire, positions[pixel], normals[pixel], &surface))
    return;
  const Scene scene = {nodes, triangles};
  const Totals totals =
      LightThesis(luminaire, sampling, images, sat, sat_scale, &surface, scene, scratch + item);
  StoreTotals(luminaire, &surface, totals, pixel, irradiance, variance, samples);
}

// The visible share of the light per channel, and the variance of the luminance's share (of a ratio
// of sums, to first order).
__kernel void VisibleShare(SAMPLING_ARGUMENTS, __global float4* share, __global uint* samples) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  share[pixel] = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  Surface surface;
  if (!MakeSurface(luminaire, positions[pixel], normals[pixel], &surface)) return;
  const Scene scene = {nodes, triangles};
  const Totals totals = LightWindowed(luminaire, sampling, images, sat, sat_scale, &surface, scene,
                                      sampling->first_pixel + (uint)pixel, scratch + item);
  samples[pixel] += (uint)totals.count;
  const float light = Luminance(totals.light);
  if (!(light > 0.0f)) return;
  const float ratio = Luminance(totals.visible) / light;
  const float spread =
      (1.0f - 2.0f * ratio) * totals.visible_square + ratio * ratio * totals.square;
  const float n = (float)totals.count;
  share[pixel].x = totals.light.x > 0.0f ? totals.visible.x / totals.light.x : ratio;
  share[pixel].y = totals.light.y > 0.0f ? totals.visible.y / totals.light.y : ratio;
  share[pixel].z = totals.light.z > 0.0f ? totals.visible.z / totals.light.z : ratio;
  share[pixel].w =
      totals.count > 1 ? fmax(spread, 0.0f) / (light * light) * (n / (n - 1.0f)) : 1.0f;
}
