// The film of a band of a picture: what lights add to its pixels (render/film/band_film.h).
#include "luxfield/render/kernels/film/lit_draw_types.clh"
#include "luxfield/render/kernels/math/double_float.clh"
#include "luxfield/render/kernels/math/luminance.clh"
#include "luxfield/render/kernels/math/variance.clh"

// Sums of rows: row 0 is the whole light, row 1 + l that of light l where lights are told apart.
static inline size_t RowPlace(int row, int count, int pixel) { return (size_t)row * count + pixel; }

// By what the luminance of `light` changes where its channels are scaled; between the least and the
// most of the scales, which holds of all light that is nowhere negative.
static inline float LuminanceScale(float3 light, float3 scale) {
  const float least = fmin(fmin(scale.x, scale.y), scale.z),
              most = fmax(fmax(scale.x, scale.y), scale.z), luminance = Luminance(light);
  return luminance == 0.0f ? most : clamp(Luminance(scale * light) / luminance, least, most);
}

// Adds what an estimator found for one light, times the `scale` of its channels, at the points of a
// part of the band.
// `pixels` says which pixels these are; null: all, in order. Radiance is `reflected`, where that is
// null albedo / pi times the irradiance. The variance is that of the luminance of what the estimate is
// of, which is taken to have one colour at a point: scales and albedo change it as they change that.
// `row` > 0: the light's own. `group_radiance`, `group_irradiance` receive 1 / passes of it; null:
// there are no groups.
__kernel void AddLight(__global const float4* irradiance, __global const float4* reflected,
                       __global const float* variance, __global const uint* samples,
                       __global const float4* albedos, __global const int* pixels, int points,
                       int count, float4 scale, int row, float passes,
                       __global float4* pass_radiance, __global float4* pass_irradiance,
                       __global float* pass_samples, __global float* luminances,
                       __global float* stated_variances, __global float4* group_radiance,
                       __global float4* group_irradiance) {
  const int k = get_global_id(0);
  if (k >= points) return;
  const int pixel = pixels ? pixels[k] : k;
  const float3 albedo = albedos[k].xyz, light = scale.xyz * irradiance[k].xyz;
  const float3 radiance = reflected ? scale.xyz * reflected[k].xyz : albedo * M_1_PI_F * light;
  const float dimmed = LuminanceScale(reflected ? reflected[k].xyz : irradiance[k].xyz, scale.xyz);
  const float shown = reflected ? 1.0f : Luminance(albedo) * M_1_PI_F;
  const float luminance = Luminance(radiance),
              stated = dimmed * dimmed * shown * shown * variance[k];
  pass_radiance[pixel].xyz += radiance;
  pass_irradiance[pixel].xyz += light;
  pass_samples[pixel] += (float)samples[k];
  luminances[pixel] += luminance;
  stated_variances[pixel] += stated;
  if (row > 0) {
    luminances[RowPlace(row, count, pixel)] = luminance;
    stated_variances[RowPlace(row, count, pixel)] = stated;
  }
  if (group_radiance) {
    group_radiance[pixel].xyz += radiance / passes;
    group_irradiance[pixel].xyz += light / passes;
  }
}

// What an estimator found at the points that drew lights, one after the other.
#define FOUND_ARGUMENTS                                                             \
  __global const float4 *irradiance, __global const float4 *reflected,              \
      __global const float *variance, __global const uint *samples
#define FOUND irradiance, reflected, variance, samples
// The draws of points first_point, first_point + 1 ...: of the k-th draws[starts[k]] to
// draws[starts[k + 1]]; `albedos` and `pixels` are of all points of the part, as AddLight has them.
#define DRAWN_ARGUMENTS                                                             \
  __global const float4 *albedos, __global const int *pixels, int first_point, int points, \
      __global const int *starts, __global const LitDraw *draws

typedef struct DrawnLight {
  float3 light, radiance;
  float luminance, variance;
  int samples;
} DrawnLight;

static inline DrawnLight FindDrawn(FOUND_ARGUMENTS, float3 albedo, LitDraw draw) {
  const float3 scale = draw.weight * vload3(0, draw.scale);
  DrawnLight drawn;
  drawn.light = scale * irradiance[draw.place].xyz;
  drawn.radiance = reflected ? scale * reflected[draw.place].xyz : albedo * M_1_PI_F * drawn.light;
  drawn.luminance = Luminance(drawn.radiance);
  const float shown =
      LuminanceScale(reflected ? reflected[draw.place].xyz : irradiance[draw.place].xyz, scale) *
      (reflected ? 1.0f : Luminance(albedo) * M_1_PI_F);
  drawn.variance = shown * shown * variance[draw.place];
  drawn.samples = (int)samples[draw.place];
  return drawn;
}

// AddLight for points that drew several lights. All samples of a point are taken as independent
// draws from all lights; a light's own variance, where it is drawn by chance, is bounded by its
// square.
__kernel void AddDrawnLights(FOUND_ARGUMENTS, DRAWN_ARGUMENTS, int count, int lights_apart,
                             __global float4* pass_radiance, __global float4* pass_irradiance,
                             __global float* pass_samples, __global float* luminances,
                             __global float* stated_variances) {
  const int k = get_global_id(0);
  if (k >= points) return;
  const int pixel = pixels ? pixels[first_point + k] : first_point + k;
  const float3 albedo = albedos[first_point + k].xyz;
  float3 radiance = (float3)(0.0f), light = (float3)(0.0f);
  float luminance = 0.0f, squares = 0.0f;
  int all_samples = 0;
  for (int i = starts[k]; i < starts[k + 1]; ++i) {
    const LitDraw draw = draws[i];
    const DrawnLight drawn = FindDrawn(FOUND, albedo, draw);
    radiance += drawn.radiance;
    light += drawn.light;
    luminance += drawn.luminance;
    squares += SquaresOfSum(drawn.luminance, drawn.variance, drawn.samples);
    all_samples += drawn.samples;
    if (!lights_apart) continue;
    const size_t at = RowPlace(1 + draw.light, count, pixel);
    luminances[at] = drawn.luminance;
    stated_variances[at] =
        draw.weight > 1.0f ? drawn.luminance * drawn.luminance : drawn.variance;
  }
  pass_radiance[pixel].xyz += radiance;
  pass_irradiance[pixel].xyz += light;
  pass_samples[pixel] += (float)all_samples;
  luminances[pixel] += luminance;
  stated_variances[pixel] += VarianceOfSum(luminance, squares, all_samples);
}

// Adds 1 / passes of what lights of `group` bring to the group's pictures.
__kernel void AddDrawnGroup(FOUND_ARGUMENTS, DRAWN_ARGUMENTS, int group, float passes,
                            __global float4* group_radiance, __global float4* group_irradiance) {
  const int k = get_global_id(0);
  if (k >= points) return;
  const int pixel = pixels ? pixels[first_point + k] : first_point + k;
  const float3 albedo = albedos[first_point + k].xyz;
  for (int i = starts[k]; i < starts[k + 1]; ++i) {
    if (draws[i].group != group) continue;
    const DrawnLight drawn = FindDrawn(FOUND, albedo, draws[i]);
    group_radiance[pixel].xyz += drawn.radiance / passes;
    group_irradiance[pixel].xyz += drawn.light / passes;
  }
}

// Adds what a pass showed to the film's means over `passes` passes.
__kernel void AddPass(__global const float4* pass_radiance, __global const float4* pass_irradiance,
                      __global const float* pass_samples, __global const float* stated_variances,
                      int count, float passes, __global float4* radiance,
                      __global float4* irradiance, __global float* samples,
                      __global float* stated) {
  const int pixel = get_global_id(0);
  if (pixel >= count) return;
  radiance[pixel].xyz += pass_radiance[pixel].xyz / passes;
  irradiance[pixel].xyz += pass_irradiance[pixel].xyz / passes;
  samples[pixel] += pass_samples[pixel];
  stated[pixel] += stated_variances[pixel] / (passes * passes);
}

// Adds the luminances of pass number `pass` to their sums over passes and pixel samples, and to the
// means, pairs of floats, and squared deviations of the passes (Welford 1962), which start at pass
// 0. `means` null: there is one pass.
__kernel void AddLuminances(__global const float* luminances, int count, int rows, int pass,
                            __global float* sums, __global float2* means,
                            __global float* squares) {
  const int pixel = get_global_id(0), row = get_global_id(1);
  if (pixel >= count || row >= rows) return;
  const size_t at = RowPlace(row, count, pixel);
  const float luminance = luminances[at];
  sums[at] += luminance;
  if (!means) return;
  const DoubleFloat mean =
      pass == 0 ? MakeDoubleFloat(0.0f, 0.0f) : MakeDoubleFloat(means[at].x, means[at].y);
  const float deviation = (luminance - mean.hi) - mean.lo, number = (float)(pass + 1);
  const DoubleFloat next = AddDoubleFloat(mean, MakeDoubleFloat(deviation / number, 0.0f));
  means[at] = (float2)(next.hi, next.lo);
  squares[at] = (pass == 0 ? 0.0f : squares[at]) + deviation * deviation * (float)pass / number;
}

// Adds the variances of a pixel sample's luminances to their sums: from the spread between passes,
// or, of a single pass, as it states them itself.
__kernel void AddVariances(__global const float* stated_variances, __global const float* squares,
                           int count, int rows, float passes, __global float* sums) {
  const int pixel = get_global_id(0), row = get_global_id(1);
  if (pixel >= count || row >= rows) return;
  const size_t at = RowPlace(row, count, pixel);
  sums[at] += squares ? squares[at] / (passes * (passes - 1.0f)) : stated_variances[at];
}

// Adds `scale` times the radiance that a pixel shows by itself; `group_radiance` as AddLight.
__kernel void AddRadiance(__global const float4* shown, int count, float scale,
                          __global float4* radiance, __global float4* group_radiance) {
  const int pixel = get_global_id(0);
  if (pixel >= count) return;
  const float3 value = scale * shown[pixel].xyz;
  radiance[pixel].xyz += value;
  if (group_radiance) group_radiance[pixel].xyz += value;
}

// 1 where a pixel's ray hit something, 0 elsewhere; and adds it to the coverage.
__kernel void AddHits(__global const float4* positions, int count, __global float* hits,
                      __global float* coverage) {
  const int pixel = get_global_id(0);
  if (pixel >= count) return;
  hits[pixel] = positions[pixel].w;
  coverage[pixel] += positions[pixel].w;
}

// values[pixels[k]], one after the other.
__kernel void GatherPixels(__global const int* pixels, int points, __global const float4* values,
                           __global float4* gathered) {
  const int k = get_global_id(0);
  if (k < points) gathered[k] = values[pixels[k]];
}
