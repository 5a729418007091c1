// Importance sampling in windows (docs/theory.md 6): images are allotted samples in proportion to
// the mass M_m of their windows, the integral of |C_m|; a sample of density p(y) on the support of
// Phi_m adds
//
//   delta^2 / z^3 h^2 (v_m M_m / nbar_m) C_m(s(y)) Phi_m(y) / (M_m p(y)) (n . (u - p))+ V
//
// with v_m the image's visibility by shadow maps, 1 without them; images are allotted by v_m M_m.
//
// PROPOSAL = MASS_AND_BASIS: p = (1 - b) |C| / M + b Phi / area, one-sample balance heuristic
// (Veach 1997) of what follows |C|, good where a window holds structure, and what follows Phi, good
// where C hardly varies in it. BASIS: b = 1. UNIFORM: p is constant over what is seen of the
// window.
//
// Where a surface is glossy, K_b of the samples follow its BRDF instead with density q
// (brdf_sampling.clh): the balance heuristic replaces nbar_m p by nbar_m p + K_b q, and a sample of
// the BRDF adds all images whose support covers its point,
//
//   delta^2 / z^3 h^2 sum_m v_m C_m Phi_m / (nbar_m p_m + K_b q) (n . (u - p))+ V
#include "luxfield/render/kernels/luminaire/window_lighting.clh"

#define MASS_AND_BASIS 0
#define UNIFORM 1
#define BASIS 2
#ifndef PROPOSAL
#define PROPOSAL MASS_AND_BASIS
#endif

#if GLOSSY && PROPOSAL == MASS_AND_BASIS
#define FOLLOW_BRDF 1
#include "luxfield/render/kernels/luminaire/brdf_sampling.clh"
#else
#define FOLLOW_BRDF 0
#endif

#if PROPOSAL != UNIFORM
// The point of a window that follows Phi; off the image its texel is -1.
static inline WindowSample DrawBasisPoint(__constant const LuminaireParams* luminaire,
                                          const Surface* surface, const Window* window, float2 xi) {
  const float area = BasisArea(&luminaire->basis), cells = (float)luminaire->basis.cells;
  WindowSample at;
  at.y = (float2)(InvertBasis(&luminaire->basis, area, xi.x),
                  InvertBasis(&luminaire->basis, area, xi.y));
  at.column =
      TexelAt(&surface->x, window->columns.low, luminaire->axis[0].texels, at.y.x, cells);
  at.row = TexelAt(&surface->y, window->rows.low, luminaire->axis[1].texels, at.y.y, cells);
  return at;
}
#endif

// kDraws made side by side take as long as so many made one by one.
enum { kWorthDraws = 3 };

// Draws `count` points of a window, kDraws at most.
static inline void DrawPoints(__constant const LuminaireParams* luminaire,
                              __constant const SamplingParams* sampling, const Surface* surface,
                              const Window* window, const Marginal* marginal, const float2* xi,
                              int count, WindowSample* points) {
#if PROPOSAL == UNIFORM
  const float cells = (float)luminaire->basis.cells;
  for (int k = 0; k < count; ++k) {
    const Place column = UniformPlace(window->columns, xi[k].x),
                row = UniformPlace(window->rows, xi[k].y);
    points[k].column = column.texel;
    points[k].row = row.texel;
    points[k].y = (float2)(SupportCoordinate(&surface->x, window->columns, column, cells),
                           SupportCoordinate(&surface->y, window->rows, row, cells));
  }
#elif PROPOSAL == BASIS
  for (int k = 0; k < count; ++k) points[k] = DrawBasisPoint(luminaire, surface, window, xi[k]);
#else
  const float share = sampling->basis_share;
  // Those that follow |C|, and which of the points they are.
  float2 rest[kDraws];
  int which[kDraws], rest_count = 0;
  for (int k = 0; k < count; ++k) {
    if (xi[k].x < share) {
      points[k] = DrawBasisPoint(luminaire, surface, window, (float2)(xi[k].x / share, xi[k].y));
      continue;
    }
    rest[rest_count] = (float2)((xi[k].x - share) / (1.0f - share), xi[k].y);
    which[rest_count++] = k;
  }
  const WindowTable table = {window->sat,
                             window->sat_width,
                             &surface->x,
                             &surface->y,
                             window->columns,
                             window->rows,
                             (float)luminaire->basis.cells};
  WindowSample drawn[kDraws];
  if (rest_count < kWorthDraws) {
    for (int k = 0; k < rest_count; ++k) SampleWindow(&table, marginal, &rest[k], 1, &drawn[k]);
  } else {
    for (int k = rest_count; k < kDraws; ++k) rest[k] = rest[0];
    SampleWindow(&table, marginal, rest, kDraws, drawn);
  }
  for (int k = 0; k < rest_count; ++k) points[which[k]] = drawn[k];
#endif
}

// C Phi at a point, 0 off the image, and `density` = M p there. Both may be in units of |C| if
// `ratio_only`.
static inline float3 FluxAt(LUMINAIRE_ARGUMENTS, const Window* window, float mass, bool ratio_only,
                            WindowSample at, float* density) {
  *density = 1.0f;
  if (at.column < 0 || at.row < 0) return (float3)(0.0f);
  const float phi = BasisProduct(luminaire, at.y);
#if PROPOSAL == UNIFORM
  *density = mass / SeenArea(window);
  return TexelValue(luminaire, images, window->m, at.column, at.row) * phi;
#else
  const float share = PROPOSAL == BASIS ? 1.0f : sampling->basis_share;
  if (share == 0.0f && ratio_only)
    return phi * Chroma(luminaire, images, window->m, at.column, at.row);
  const float3 value = TexelValue(luminaire, images, window->m, at.column, at.row);
  *density = MixedDensity(luminaire, share, mass, Magnitude(value), phi);
  return value * phi;
#endif
}

#if FOLLOW_BRDF
// The sum over images at the point `at` on F, in units of h from the lower corner of all supports,
// with `brdf_density` = K_b q there.
static inline float3 LightOfPoint(LUMINAIRE_ARGUMENTS, const Surface* surface, Windows windows,
                                  const Allocation* allocation, float2 at, float brdf_density) {
  const int cells = luminaire->basis.cells, columns = luminaire->axis[0].count,
            rows = luminaire->axis[1].count;
  float3 light = (float3)(0.0f);
  if (!(at.x >= 0.0f && at.x < (float)(columns + cells) && at.y >= 0.0f &&
        at.y < (float)(rows + cells)))
    return light;
  const int cell_i = (int)at.x, cell_j = (int)at.y;
  for (int j = max(cell_j - cells + 1, 0); j <= min(cell_j, rows - 1); ++j)
    for (int i = max(cell_i - cells + 1, 0); i <= min(cell_i, columns - 1); ++i) {
      const int m = j * columns + i;
      const float mass = windows.masses[(size_t)m * windows.stride];
      const float2 y = at - (float2)((float)i, (float)j);
      const int column = TexelAt(&surface->x, LowKnot(&surface->x, i, cells),
                                 luminaire->axis[0].texels, y.x, (float)cells),
                row = TexelAt(&surface->y, LowKnot(&surface->y, j, cells),
                              luminaire->axis[1].texels, y.y, (float)cells);
      if (!(mass > 0.0f) || column < 0 || row < 0) continue;
      const float visibility = ImageVisibility(luminaire, windows.seen, i, j),
                  window_mass = mass / visibility;
      const float phi = BasisProduct(luminaire, y);
      const float3 value = TexelValue(luminaire, images, m, column, row);
      const float light_density =
          ExpectedSamples(allocation, mass) / window_mass *
          MixedDensity(luminaire, sampling->basis_share, window_mass, Magnitude(value), phi);
      light += value * (visibility * phi / (light_density + brdf_density));
    }
  return light;
}

static inline void AddBrdfSamples(LUMINAIRE_ARGUMENTS, const Surface* surface,
                                  const ShadowRays* shadow, Windows windows,
                                  const Allocation* allocation, int count, uint4 words,
                                  Totals* totals) {
  BrdfDraws draws =
      StartBrdfDraws(count, words, luminaire->axis[0].count * luminaire->axis[1].count);
  for (int k = 0; k < count; ++k) {
    float3 to_lamp, light = (float3)(0.0f);
    if (NextBrdfDraw(&draws, surface, k, &to_lamp))
      light = LightOfPoint(LUMINAIRE, surface, windows, allocation,
                           LampCoordinate(luminaire, surface, to_lamp),
                           (float)count * BrdfDensity(luminaire, surface, to_lamp));
    AddLight(luminaire, surface, shadow, to_lamp, light, totals);
  }
}
#endif

static inline Totals LightWindows(LUMINAIRE_ARGUMENTS, const Surface* surface,
                                  const ShadowRays* shadow, const LightTask* task,
                                  Windows windows) {
  Totals totals = NoLight();
  const float total = TotalMass(luminaire, windows);
  if (!(total > 0.0f)) return totals;
  const uint4 words = TaskWords(sampling, task, 0u);
#if FOLLOW_BRDF
  const int brdf_samples = BrdfSamples(luminaire, sampling, task->samples, surface);
#else
  const int brdf_samples = 0;
#endif
  Allocation allocation =
      StartAllocation(sampling, task->samples - brdf_samples, total, UnitFloat(words.x));
#if FOLLOW_BRDF
  AddBrdfSamples(LUMINAIRE, surface, shadow, windows, &allocation, brdf_samples, words, &totals);
#endif
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const float mass = windows.masses[(size_t)m * windows.stride];
      float weight;
      const int count = Allot(&allocation, mass, &weight);
      if (count == 0) continue;
      const Window window = LoadWindow(luminaire, sat, surface, windows, m, i, j);
      const float visibility = ImageVisibility(luminaire, windows.seen, i, j);
      const float window_mass = mass / visibility;
      Marginal marginal;
      if (PROPOSAL == MASS_AND_BASIS)
        marginal = MakeMarginal(window.sat, window.sat_width, window.columns, window.rows);
      const uint2 shift = ImageShift(words, m);
      uint2 point = (uint2)(0u, 0u);
      for (int drawn = 0; drawn < count; drawn += kDraws) {
        const int draws = min(count - drawn, (int)kDraws);
        float2 xi[kDraws];
        for (int k = 0; k < draws; ++k) {
          xi[k] = ShiftPoint(point, shift);
          point = NextPoint(point, (uint)(drawn + k));
        }
        WindowSample points[kDraws];
        DrawPoints(luminaire, sampling, surface, &window, &marginal, xi, draws, points);
        for (int k = 0; k < draws; ++k) {
          float density;
          const float3 flux = FluxAt(LUMINAIRE, &window, window_mass, brdf_samples == 0, points[k],
                                     &density);
          const float3 to_lamp = ToLamp(luminaire, surface, i, j, points[k].y);
          density *= visibility / weight;  // nbar p
#if FOLLOW_BRDF
          if (brdf_samples > 0)
            density += (float)brdf_samples * BrdfDensity(luminaire, surface, to_lamp);
#endif
          AddLight(luminaire, surface, shadow, to_lamp,
                   density > 0.0f ? flux * (visibility / density) : (float3)(0.0f), &totals);
        }
      }
    }
  return totals;
}

__kernel void Windowed(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS, TASK_ARGUMENTS,
                       WINDOW_ARGUMENTS, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  ClearShadowRays(&shadow);
  const LightTask task = TaskOf(sampling, tasks, pixel);
  luminaire += task.light;
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Windows windows = WINDOWS(item, pixel);
  const Totals totals = LightWindows(LUMINAIRE, &surface, &shadow, &task, windows);
  StoreTotals(luminaire, &surface, totals, &shadow, pixel, LIGHTING);
}
