// Sampling of knot cells (docs/theory.md 6, correction 3): cells are allotted samples in proportion
// to the mass of their windows times the receiver's cosine, and every sample evaluates all images
// that shine through the cell.
//
//   E = delta^2 / z^3 h^2 sum_k sum_m C_m Phi_m(y_k) (n . (u_k - p))+ V / N(y_k),
//   N(y) = nbar_ab p_ab(y) + K_b q(y),   nbar_ab = (K - K_b) w_ab M_ab / sum w M
//
// are the expected samples per dy^2, p that of cell_proposal.clh. Where a surface is glossy, K_b of
// the samples follow its BRDF with density q (brdf_sampling.clh).
#include "luxfield/render/kernels/luminaire/cell_proposal.clh"

#if GLOSSY
#include "luxfield/render/kernels/luminaire/brdf_sampling.clh"
#endif

// Adds a sample at a point of a cell.
static inline void AddCellSample(__constant const LuminaireParams* luminaire,
                                 __global const float* images, const CellTables* tables,
                                 const Surface* surface, const ShadowRays* shadow, int brdf_samples,
                                 const CellProposal* proposal, WindowSample at, Totals* totals) {
  const int a = proposal->window.i, b = proposal->window.j;
  const float3 to_lamp = ToLamp(luminaire, surface, a, b, at.y);
  float expected = CellExpectation(tables, proposal, at);
#if GLOSSY
  if (brdf_samples > 0) expected += (float)brdf_samples * BrdfDensity(luminaire, surface, to_lamp);
#endif
  const float3 flux = CellFlux(luminaire, images, a, b, at.column, at.row, at.y);
  AddLight(luminaire, surface, shadow, to_lamp, expected > 0.0f ? flux / expected : (float3)(0.0f),
           totals);
}

#if GLOSSY
// Samples that follow the BRDF. A direction that misses the lamp's cells, their windows or the
// upper side of the surface is a sample of no light, and so is one into a cell that shadow maps
// hide.
static inline void AddBrdfSamples(__constant const LuminaireParams* luminaire,
                                  __global const float* images, const CellTables* tables,
                                  const Surface* surface, const ShadowRays* shadow, Windows windows,
                                  const Allocation* allocation, int count, uint4 words,
                                  Totals* totals) {
  BrdfDraws draws = StartBrdfDraws(count, words, tables->cells.x * tables->cells.y);
  for (int k = 0; k < count; ++k) {
    float3 to_lamp;
    int2 cell;
    WindowSample at;
    float cosine = 0.0f, mass = 0.0f;
    if (NextBrdfDraw(&draws, surface, k, &to_lamp) &&
        CellAlong(luminaire, tables, surface, to_lamp, &cell, &at)) {
      cosine = CellCosine(luminaire, surface, cell.x, cell.y);
      mass = windows.masses[(size_t)(cell.y * tables->cells.x + cell.x) * windows.stride];
    }
    if (!(cosine * mass > 0.0f)) {
      ++totals->count;
      continue;
    }
    const CellProposal proposal =
        MakeCellProposal(luminaire, images, tables, surface, windows, cell, mass,
                         ExpectedSamples(allocation, cosine * mass));
    AddCellSample(luminaire, images, tables, surface, shadow, count, &proposal, at, totals);
  }
}
#endif

static inline Totals LightCells(__constant const LuminaireParams* luminaire,
                                __constant const SamplingParams* sampling,
                                __global const float* images, const CellTables* tables,
                                const Surface* surface, const ShadowRays* shadow,
                                const LightTask* task, Windows windows) {
  Totals totals = NoLight();
  const float total = WeightedTotal(luminaire, tables, surface, windows);
  if (!(total > 0.0f)) return totals;
  const uint4 words = TaskWords(sampling, task, 0u);
#if GLOSSY
  const int brdf_samples = BrdfSamples(luminaire, sampling, task->samples, surface);
#else
  const int brdf_samples = 0;
#endif
  Allocation allocation =
      StartAllocation(sampling, task->samples - brdf_samples, total, UnitFloat(words.x));
  // One sequence over all cells: neighbours get points that complete each other.
  uint2 point = (uint2)(0u, 0u);
  int k = 0;
  for (int b = 0; b < tables->cells.y; ++b)
    for (int a = 0; a < tables->cells.x; ++a) {
      const float mass = windows.masses[(size_t)(b * tables->cells.x + a) * windows.stride],
                  weighted = CellCosine(luminaire, surface, a, b) * mass;
      float weight;
      const int end = k + Allot(&allocation, weighted, &weight);
      if (end == k) continue;
      const CellProposal proposal = MakeCellProposal(luminaire, images, tables, surface, windows,
                                                     (int2)(a, b), mass, weighted / weight);
      const Window* window = &proposal.window;
      Marginal marginal;
      if (proposal.fit_share < 1.0f)
        marginal = MakeMarginal(window->sat, window->sat_width, window->columns, window->rows);
      for (; k < end; ++k) {
        const WindowSample at =
            DrawCellPoint(luminaire, surface, &proposal, &marginal, ShiftPoint(point, words.yz));
        point = NextPoint(point, (uint)k);
        AddCellSample(luminaire, images, tables, surface, shadow, brdf_samples, &proposal, at,
                      &totals);
      }
    }
#if GLOSSY
  AddBrdfSamples(luminaire, images, tables, surface, shadow, windows, &allocation, brdf_samples,
                 words, &totals);
#endif
  return totals;
}

__kernel void Cells(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS, TASK_ARGUMENTS,
                    WINDOW_ARGUMENTS, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  ClearShadowRays(&shadow);
  const LightTask task = TaskOf(sampling, tasks, pixel);
  luminaire += task.light;
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const CellTables tables = MakeCellTables(luminaire, sat, sat_scale);
  const Windows windows = {spans + item, masses + item, sampling->scratch_stride};
  const Totals totals =
      LightCells(luminaire, sampling, images, &tables, &surface, &shadow, &task, windows);
  StoreTotals(luminaire, &surface, totals, &shadow, pixel, LIGHTING);
}
