// Sampling of knot cells (THEORY.md 6, correction 3): cells are allotted samples in proportion to the
// mass of their windows times the receiver's cosine towards them, points in a cell are drawn with
// density Q / M, and every sample evaluates all images that shine through the cell.
//
//   E = delta^2 / z^3 h^2 sum_k sum_m C_m Phi_m(y_k) (n . (u_k - p))+ V / N(y_k),
//   N(y) = K w_ab Q_ab(s(y)) / sum w M    expected samples per dy^2
//
// Glossy receivers draw half of their samples from the BRDF instead and add their expectation to N
// (the balance heuristic of Veach and Guibas 1995): N(y) = K/2 w Q / sum w M + K/2 p(w) h^2 z / r^3,
// r = |u - p|.
#include "kernels/cells.clh"

inline float WeightedTotal(__constant const LuminaireParams* luminaire, const CellTables* tables,
                           const Surface* surface, Windows windows) {
  float total = 0.0f;
  int cell = 0;
  for (int b = 0; b < tables->cells.y; ++b)
    for (int a = 0; a < tables->cells.x; ++a, ++cell)
      total += CellCosine(luminaire, surface, a, b) * windows.masses[(size_t)cell * windows.stride];
  return total;
}

inline int BrdfSamples(__constant const SamplingParams* sampling, const Surface* surface) {
#if GLOSSY
  return surface->brdf.kind == kLambert ? 0 : sampling->samples / 2;
#else
  return 0;
#endif
}

// Expected samples of the BRDF per dy^2 at u - p.
inline float BrdfExpectation(__constant const LuminaireParams* luminaire, const Surface* surface,
                             int brdf_samples, float3 to_lamp) {
#if GLOSSY
  if (brdf_samples == 0) return 0.0f;
  const float h = luminaire->axis[0].spacing.hi, inverse_r = 1.0f / length(to_lamp);
  const float h_over_r = h * inverse_r;
  return (float)brdf_samples * BrdfPdf(&surface->brdf, to_lamp * inverse_r) *
         (h_over_r * h_over_r * (surface->receiver.p.z * inverse_r));
#else
  return 0.0f;
#endif
}

// Adds a sample at a point of a cell, its texel given; `weight` is M / nbar of the cell.
inline void AddCellSample(__constant const LuminaireParams* luminaire, __global const float* images,
                          const CellTables* tables, const Surface* surface, Scene scene,
                          int brdf_samples, int a, int b, WindowSample at, float cosine,
                          float weight, Totals* totals) {
  const float density = CellDensity(tables, b * tables->cells.x + a, at.column, at.row);
  const float3 to_lamp = ToLamp(luminaire, surface, a, b, at.y);
  const float expected = cosine * density / weight +
                         BrdfExpectation(luminaire, surface, brdf_samples, to_lamp);
  const float3 flux = CellFlux(luminaire, images, a, b, at.column, at.row, at.y);
  AddLight(luminaire, surface, scene, to_lamp, density > 0.0f ? flux / expected : (float3)(0.0f),
           totals);
}

#if GLOSSY
// Draws from the BRDF. A direction that misses the lamp's cells, their windows or the upper side of
// the surface is a sample of no light, and so is one into a cell that shadow maps hide.
inline void AddBrdfSamples(__constant const LuminaireParams* luminaire,
                           __global const float* images, const CellTables* tables,
                           const Surface* surface, Scene scene, Windows windows,
                           const Allocation* allocation, int brdf_samples, uint4 words,
                           Totals* totals) {
  uint2 point = (uint2)(0u, 0u);
  for (int k = 0; k < brdf_samples; ++k) {
    // Stratified: the parts of a BRDF get runs of the sequence.
    const float select =
        fmin(((float)k + UnitFloat(words.z)) / (float)brdf_samples, BELOW_ONE);
    float3 direction;
    const bool up = SampleBrdf(&surface->brdf, ShiftPoint(point, words.xy), select, &direction);
    point = NextPoint(point, (uint)k);
    WindowSample at;
    int2 cell;
    float cosine = 0.0f, mass = 0.0f;
    if (up && CellAlong(luminaire, tables, surface, direction, &cell, &at)) {
      cosine = CellCosine(luminaire, surface, cell.x, cell.y);
      mass = cosine * windows.masses[(size_t)(cell.y * tables->cells.x + cell.x) * windows.stride];
    }
    if (!(mass > 0.0f)) {
      ++totals->count;
      continue;
    }
    AddCellSample(luminaire, images, tables, surface, scene, brdf_samples, cell.x, cell.y, at,
                  cosine, SampleWeight(allocation, mass), totals);
  }
}
#endif

inline Totals LightCells(__constant const LuminaireParams* luminaire,
                         __constant const SamplingParams* sampling, __global const float* images,
                         const CellTables* tables, const Surface* surface, Scene scene, uint pixel,
                         Windows windows) {
  Totals totals = NoLight();
  const float total = WeightedTotal(luminaire, tables, surface, windows);
  if (!(total > 0.0f)) return totals;
  const int brdf_samples = BrdfSamples(sampling, surface);
  const uint4 words = PixelWords(sampling, pixel);
  Allocation allocation =
      StartAllocation(sampling, sampling->samples - brdf_samples, total, UnitFloat(words.x));
  // One sequence over all cells: neighbours get points that complete each other.
  uint2 point = (uint2)(0u, 0u);
  int k = 0, cell = 0;
  for (int b = 0; b < tables->cells.y; ++b)
    for (int a = 0; a < tables->cells.x; ++a, ++cell) {
      const float cosine = CellCosine(luminaire, surface, a, b);
      float weight;
      const int end =
          k + Allot(&allocation, cosine * windows.masses[(size_t)cell * windows.stride], &weight);
      if (end == k) continue;
      const Window window = LoadCellWindow(tables, surface, windows, cell, a, b);
      const Marginal marginal =
          MakeMarginal(window.sat, window.sat_width, window.columns, window.rows);
      for (; k < end; ++k) {
        const WindowSample at =
            SampleWindow(window.sat, window.sat_width, &surface->x, &surface->y, &marginal,
                         window.columns, window.rows, 1.0f, ShiftPoint(point, words.yz));
        point = NextPoint(point, (uint)k);
        AddCellSample(luminaire, images, tables, surface, scene, brdf_samples, a, b, at, cosine,
                      weight, &totals);
      }
    }
#if GLOSSY
  if (brdf_samples > 0)
    AddBrdfSamples(luminaire, images, tables, surface, scene, windows, &allocation, brdf_samples,
                   MoreWords(sampling, pixel, 1u), &totals);
#endif
  return totals;
}

__kernel void Cells(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SCENE_ARGUMENTS, WINDOW_ARGUMENTS,
                    LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  Surface surface;
  if (pixel >= sampling->end || !MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const CellTables tables = MakeCellTables(luminaire, sat, sat_scale);
  const Scene scene = {nodes, triangles};
  const Windows windows = {spans + item, masses + item, sampling->scratch_stride};
  const Totals totals = LightCells(luminaire, sampling, images, &tables, &surface, scene,
                                   sampling->first_pixel + (uint)pixel, windows);
  StoreTotals(luminaire, &surface, totals, pixel, LIGHTING);
}

// The visible share of `light` per channel, and the variance of the luminance's share (of a ratio
// of sums, to first order); squares are of luminances, one per sample.
inline float4 ShareOf(float3 visible, float visible_square, float3 light, float square, int count) {
  const float luminance = Luminance(light);
  if (!(luminance > 0.0f)) return (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  const float ratio = Luminance(visible) / luminance, n = (float)count;
  const float spread = (1.0f - 2.0f * ratio) * visible_square + ratio * ratio * square;
  return (float4)(light.x > 0.0f ? visible.x / light.x : ratio,
                  light.y > 0.0f ? visible.y / light.y : ratio,
                  light.z > 0.0f ? visible.z / light.z : ratio,
                  count > 1 ? fmax(spread, 0.0f) / (luminance * luminance) * (n / (n - 1.0f))
                            : 1.0f);
}

// Visible shares of the irradiance and, where surfaces are glossy, of the reflected radiance.
__kernel void VisibleShare(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SCENE_ARGUMENTS,
                           WINDOW_ARGUMENTS, __global float4* share, __global float4* shown_share,
                           __global uint* samples) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  share[pixel] = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  if (shown_share) shown_share[pixel] = share[pixel];
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const CellTables tables = MakeCellTables(luminaire, sat, sat_scale);
  const Scene scene = {nodes, triangles};
  const Windows windows = {spans + item, masses + item, sampling->scratch_stride};
  const Totals totals = LightCells(luminaire, sampling, images, &tables, &surface, scene,
                                   sampling->first_pixel + (uint)pixel, windows);
  samples[pixel] += (uint)totals.count;
  share[pixel] =
      ShareOf(totals.visible, totals.visible_square, totals.light, totals.square, totals.count);
#if GLOSSY
  shown_share[pixel] = ShareOf(totals.reflected, totals.shown_square, totals.unshadowed,
                               totals.unshadowed_square, totals.count);
#endif
}
