// Windowed importance sampling (THEORY.md 6): images are allotted samples in proportion to the mass
// of their windows, points in a window are drawn with density C / mass.
//
//   E = delta^2 / z^3 h^2 sum_m M_m / nbar_m sum_k c Phi_m(y_k) (n . (u_k - p))+ V,   K_m of
//   expectation nbar_m
#include "kernels/random.clh"
#include "kernels/sampling_types.clh"
#include "kernels/shading.clh"
#include "kernels/shadow_maps.clh"
#include "kernels/window_sampling.clh"

// The number of samples below cumulative expectation `sum`, floor(sum + xi), without rounding of
// the addition.
inline int SamplesBelow(float sum, float xi) {
  const float whole = floor(sum);
  return (int)whole + ((sum - whole) + xi >= 1.0f ? 1 : 0);
}

// Adds what one sample of image m shows, per unit of `weight` = M_m / nbar_m.
inline void AddSample(__constant const LuminaireParams* luminaire, __global const float* images,
                      const Surface* surface, Scene scene, int m, int i, int j, WindowSample sample,
                      float weight, Totals* totals) {
  float3 light = weight * BasisValue(&luminaire->basis, sample.y.x) *
                 BasisValue(&luminaire->basis, sample.y.y);
  if (luminaire->channels == 3) {
    const size_t plane = (size_t)luminaire->axis[1].texels * luminaire->row_stride;
    __global const float* texel =
        images + (size_t)m * 3 * plane + (size_t)sample.row * luminaire->row_stride + sample.column;
    const float3 rgb = (float3)(texel[0], texel[plane], texel[2 * plane]);
    const float y = Luminance(rgb);
    light *= y > 0.0f ? rgb / y : (float3)(0.0f);
  }
  AddLight(luminaire, surface, scene, ToLamp(luminaire, surface, i, j, sample.y), light, totals);
}

// Window masses of all images into scratch[m * stride]; returns their sum. Of an image, what the
// pixel's shadow maps hide (`seen`, may be null) does not count.
inline float WindowMasses(__constant const LuminaireParams* luminaire, __global const ulong* sat,
                          __global const float* sat_scale, const Surface* surface,
                          __global const uint* seen, __global float* scratch, int stride) {
  const int columns = luminaire->axis[0].texels, rows = luminaire->axis[1].texels;
  const size_t sat_size = (size_t)(columns + 1) * (rows + 1);
  float total = 0.0f;
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j) {
    const Span row_span = MakeSpan(&surface->y, j, luminaire->basis.cells, rows);
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const Span column_span = MakeSpan(&surface->x, i, luminaire->basis.cells, columns);
      const float mass = WindowMass(sat + m * sat_size, columns + 1, column_span, row_span) *
                         sat_scale[m] * ImageVisibility(luminaire, seen, i, j);
      scratch[(size_t)m * stride] = mass;
      total += mass;
    }
  }
  return total;
}

inline Totals LightWindowed(__constant const LuminaireParams* luminaire,
                            __constant const SamplingParams* sampling, __global const float* images,
                            __global const ulong* sat, __global const float* sat_scale,
                            const Surface* surface, Scene scene, __global const uint* seen,
                            uint pixel, __global float* scratch) {
  Totals totals = NoLight();
  const int stride = sampling->scratch_stride;
  const float total = WindowMasses(luminaire, sat, sat_scale, surface, seen, scratch, stride);
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
                          const Surface* surface, Scene scene, __global const uint* seen,
                          __global float* scratch) {
  Totals totals = NoLight();
  const int stride = sampling->scratch_stride;
  const float total = WindowMasses(luminaire, sat, sat_scale, surface, 0, scratch, stride);
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
      const float weight = mass / share * ImageVisibility(luminaire, seen, i, j);
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
        AddSample(luminaire, images, surface, scene, m, i, j, sample, weight, &totals);
      }
    }
  return totals;
}

#define SAMPLING_ARGUMENTS                                                                      \
  __constant const LuminaireParams *luminaire, __constant const SamplingParams *sampling,       \
      __global const float *images, __global const ulong *sat, __global const float *sat_scale, \
      SURFACE_ARGUMENTS, SCENE_ARGUMENTS, __global const uint *seen, __global float *scratch

__kernel void Windowed(SAMPLING_ARGUMENTS, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  Surface surface;
  if (pixel >= sampling->end || !MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Scene scene = {nodes, triangles};
  const Totals totals = LightWindowed(luminaire, sampling, images, sat, sat_scale, &surface, scene,
                                      SeenByPixel(luminaire, seen, pixel),
                                      sampling->first_pixel + (uint)pixel, scratch + item);
  StoreTotals(luminaire, &surface, totals, pixel, LIGHTING);
}

__kernel void Thesis(SAMPLING_ARGUMENTS, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  Surface surface;
  if (pixel >= sampling->end || !MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Scene scene = {nodes, triangles};
  const Totals totals = LightThesis(luminaire, sampling, images, sat, sat_scale, &surface, scene,
                                    SeenByPixel(luminaire, seen, pixel), scratch + item);
  StoreTotals(luminaire, &surface, totals, pixel, LIGHTING);
}

// The visible share of `light` per channel, and the variance of the luminance's share (of a ratio of
// sums, to first order); squares are of luminances, one per sample.
inline float4 ShareOf(float3 visible, float visible_square, float3 light, float square, int count) {
  const float luminance = Luminance(light);
  if (!(luminance > 0.0f)) return (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  const float ratio = Luminance(visible) / luminance, n = (float)count;
  const float spread = (1.0f - 2.0f * ratio) * visible_square + ratio * ratio * square;
  return (float4)(
      light.x > 0.0f ? visible.x / light.x : ratio, light.y > 0.0f ? visible.y / light.y : ratio,
      light.z > 0.0f ? visible.z / light.z : ratio,
      count > 1 ? fmax(spread, 0.0f) / (luminance * luminance) * (n / (n - 1.0f)) : 1.0f);
}

// Visible shares of the irradiance and, where surfaces are glossy, of the reflected radiance.
__kernel void VisibleShare(SAMPLING_ARGUMENTS, __global float4* share,
                           __global float4* shown_share, __global uint* samples) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  share[pixel] = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  if (shown_share) shown_share[pixel] = share[pixel];
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Scene scene = {nodes, triangles};
  const Totals totals = LightWindowed(luminaire, sampling, images, sat, sat_scale, &surface, scene,
                                      SeenByPixel(luminaire, seen, pixel),
                                      sampling->first_pixel + (uint)pixel, scratch + item);
  samples[pixel] += (uint)totals.count;
  share[pixel] =
      ShareOf(totals.visible, totals.visible_square, totals.light, totals.square, totals.count);
#if GLOSSY
  shown_share[pixel] = ShareOf(totals.reflected, totals.shown_square, totals.unshadowed,
                               totals.unshadowed_square, totals.count);
#endif
}
