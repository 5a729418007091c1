// Environment maps light a G-buffer (docs/theory.md 8): of N_s samples per pixel N_7 follow the
// BRDF, the others the map, N_f of them (a real number) tile f; with beta_i = clamp(N_f - i, 0, 1)
//
//   L_o ~ sum_f sum_i beta_i g_fi + sum_k g_k,   g = L f_r (n . w)+ V / (N_f pdf_f + N_7 pdf_B)
//
// (balance heuristic, Veach 1997). beta sums to N_f: no bias, and no jump where N_f passes a whole
// number.
#include "luxfield/render/kernels/environment/environment_sampling.clh"
#include "luxfield/render/kernels/sample/brdf_draws.clh"
#include "luxfield/render/kernels/sample/lit_point.clh"

// 1: samples are counted only where they can bring light: above the horizon and of density above 0.
#ifndef COUNT_USEFUL
#define COUNT_USEFUL 0
#endif

// Item (sample, range, set): samples that pixels share, drawn before shading. Ranges without energy
// are left alone.
__kernel void DrawSets(ENVIRONMENT_ARGUMENTS, __constant const SamplingParams* sampling,
                       __constant const EnvironmentSampling* environment_sampling,
                       __global EnvironmentDraw* draws) {
  const Environment environment = ENVIRONMENT;
  const int balance = environment_sampling->balance, capacity = environment_sampling->capacity,
            ranges = RangeCount(&environment, balance),
            sets = environment_sampling->sets_per_side * environment_sampling->sets_per_side;
  const int k = get_global_id(0), index = get_global_id(1), set = index / ranges;
  if (k >= capacity || set >= sets) return;
  const EnvironmentRange range = RangeAt(&environment, balance, index % ranges);
  if (row_starts[range.end_row] == row_starts[range.first_row]) return;
  // Words of their own: the second counter word tells sets from pixels.
  const uint4 words = Philox((uint4)((uint)index, 1u, sampling->stream, 0u),
                             (uint2)(sampling->seed_lo, sampling->seed_hi));
  const EnvironmentSample sample = DrawEnvironment(&environment, range.first_row, range.end_row,
                                                   PointAt((uint)k) ^ words.xy);
  __global EnvironmentDraw* draw = draws + (size_t)index * capacity + k;
  vstore3(sample.direction, 0, draw->direction);
  vstore3(sample.radiance, 0, draw->radiance);
  draw->weight = sample.weight;
}

// Adds a sample that counts `share` times where samples are `density` a steradian.
static inline void AddEnvironmentLight(const LitPoint* receiver, const ShadowRays* shadow,
                                       float3 direction, float3 radiance, float share,
                                       float density, Totals* totals) {
  const bool useful = dot(receiver->brdf.normal, direction) > 0.0f && density > 0.0f;
  if (useful || !COUNT_USEFUL) ++totals->count;
  if (useful)
    AddIncident(receiver, shadow, direction, MAXFLOAT, radiance, share / density, 0.0f, totals);
}

// `draws` null: every pixel draws samples of its own.
__kernel void LightEnvironment(ENVIRONMENT_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS,
                               __constant const SamplingParams* sampling,
                               __constant const EnvironmentSampling* environment_sampling,
                               __global const EnvironmentDraw* draws, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  ClearShadowRays(&shadow);
  if (positions[pixel].w == 0.0f) return;
  const Environment environment = ENVIRONMENT;
  const LitPoint receiver = MakeLitPoint(environment.params->rotation, SURFACE(pixel));
  const float3 normal = receiver.brdf.normal;
  const int balance = environment_sampling->balance, capacity = environment_sampling->capacity,
            ranges = RangeCount(&environment, balance),
            brdf_samples = environment_sampling->brdf_samples;
  const float brdf_count = (float)brdf_samples;
  const float per_preference =
      SamplesPerPreference(&environment, balance, environment_sampling->light_samples, normal);
  const uint number = sampling->first_pixel + (uint)pixel;
  const uint4 words = PixelWords(sampling, number);
  const uint side = (uint)environment_sampling->sets_per_side,
             width = (uint)environment_sampling->width,
             set = number / width % side * side + number % width % side;

  Totals totals = NoLight();
  for (int range = 0; range < ranges; ++range) {
    const EnvironmentRange rows = RangeAt(&environment, balance, range);
    const float density_scale =
        per_preference * TilePreference(&environment, balance, range, normal);
    const float count = balance == kBalanceNone
                            ? environment_sampling->light_samples
                            : density_scale * environment.energies[range];
    if (!(density_scale > 0.0f && count > 0.0f)) continue;
    const size_t first = ((size_t)set * ranges + range) * capacity;
    const uint2 shift = ImageShift(words, range);
    uint2 point = (uint2)(0u, 0u);
    for (int i = 0; (float)i < count && i < capacity; ++i) {
      EnvironmentSample sample;
      if (draws) {
        sample.direction = vload3(0, draws[first + i].direction);
        sample.weight = draws[first + i].weight;
        sample.radiance = vload3(0, draws[first + i].radiance);
      } else {
        sample = DrawEnvironment(&environment, rows.first_row, rows.end_row, point ^ shift);
        point = NextPoint(point, (uint)i);
      }
      const float density = density_scale * sample.weight +
                            brdf_count * BrdfPdf(&receiver.brdf, sample.direction);
      AddEnvironmentLight(&receiver, &shadow, sample.direction, sample.radiance,
                          fmin(count - (float)i, 1.0f), density, &totals);
    }
  }
  BrdfDraws brdf_draws = StartBrdfDraws(brdf_samples, words, ranges);
  for (int k = 0; k < brdf_samples; ++k) {
    float3 direction;
    if (!NextBrdfDirection(&brdf_draws, &receiver.brdf, k, &direction)) {
      if (!COUNT_USEFUL) ++totals.count;
      continue;
    }
    const IncidentLight light = EnvironmentAt(&environment, direction);
    const float density = per_preference * light.weight *
                              TilePreference(&environment, balance, light.tile, normal) +
                          brdf_count * BrdfPdf(&receiver.brdf, direction);
    AddEnvironmentLight(&receiver, &shadow, direction, light.radiance, 1.0f, density,
                        &totals);
  }
  FinishPixel(&totals, 1.0f, &shadow, pixel, LIGHTING);
}
