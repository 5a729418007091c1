// The estimator as printed in the thesis, 4.14 to 4.18: the marginal was integrated over all t
// before it is restricted to the window, K_m = round(A_m / A K), and one sequence serves every
// image and pixel. Biased (docs/theory.md 6). The receiver's cosine, absent in print, is kept:
// without it the sum is no irradiance. It knows C >= 0 alone; what is negative is drawn by |C| and
// counts as it is.
#include "luxfield/render/kernels/luminaire/window_lighting.clh"

// The texels between which rising sums pass a wanted value: sum(low) <= wanted < sum(high).
typedef struct Bracket {
  int low, high;
  float low_sum, high_sum;
} Bracket;

// Where a straight line between the bracket's ends passes the wanted value.
static inline int StraightGuess(Bracket b, float wanted) {
  const float share = (wanted - b.low_sum) / (b.high_sum - b.low_sum);
  return clamp(b.low + (int)(share * (float)(b.high - b.low)), b.low, b.high - 1);
}

// At most `depth` steps of bisection or of the secant search (regula falsi), then a straight line
// through what is left. SUM(t): sum at the left edge of texel t.
#define LIMITED_SEARCH(bracket, wanted, SUM)                                                   \
  for (int step = 0; bracket.high - bracket.low > 1 && (depth == 0 || step < depth); ++step) { \
    const int middle = secant ? max(StraightGuess(bracket, wanted), bracket.low + 1)           \
                              : (bracket.low + bracket.high) / 2;                              \
    const float sum = SUM(middle);                                                             \
    if (sum <= wanted) {                                                                       \
      bracket.low = middle;                                                                    \
      bracket.low_sum = sum;                                                                   \
    } else {                                                                                   \
      bracket.high = middle;                                                                   \
      bracket.high_sum = sum;                                                                  \
    }                                                                                          \
  }

static inline Place PlaceOnLine(Bracket b, float wanted) {
  const float at = clamp((wanted - b.low_sum) / (b.high_sum - b.low_sum), 0.0f, BELOW_ONE) *
                   (float)(b.high - b.low);
  const int whole = min((int)at, b.high - b.low - 1);
  const Place place = {b.low + whole, clamp(at - (float)whole, 0.0f, BELOW_ONE)};
  return place;
}

static inline Place LimitedMarginal(const Marginal* marginal, Span columns, float xi, int secant,
                                    int depth) {
  Place place;
  float wanted;
  if (PlaceAtEnds(marginal->first, marginal->inner, marginal->last, columns, xi, &place, &wanted))
    return place;
  Bracket bracket = {columns.begin + 1, columns.end - 1, 0.0f, marginal->inner_sum};
  wanted = fmin(wanted, bracket.high_sum * WITHIN);
#define COLUMN_SUM(column) MarginalSum(marginal, column)
  LIMITED_SEARCH(bracket, wanted, COLUMN_SUM)
#undef COLUMN_SUM
  return PlaceOnLine(bracket, wanted);
}

static inline Place LimitedConditional(const Conditional* conditional, Span rows, float xi,
                                       int secant, int depth) {
  Place place;
  float wanted;
  if (PlaceAtEnds(conditional->first, conditional->inner, conditional->last, rows, xi, &place,
                  &wanted))
    return place;
  Bracket bracket = {rows.begin + 1, rows.end - 1, 0.0f, conditional->inner_sum};
  wanted = fmin(wanted, bracket.high_sum * WITHIN);
#define ROW_SUM(row) ConditionalSum(conditional, row)
  LIMITED_SEARCH(bracket, wanted, ROW_SUM)
#undef ROW_SUM
  return PlaceOnLine(bracket, wanted);
}

// K_m = round(A_m / A K), each sample weighing A_m / K_m.
static inline int RoundedShare(__constant const SamplingParams* sampling, int samples, float mass,
                               float total, float* weight) {
  float share = rint(mass / total * (float)samples);
  if (sampling->max_per_image > 0.0f) share = fmin(share, rint(sampling->max_per_image));
  *weight = share > 0.0f ? mass / share : 0.0f;
  return (int)share;
}

static inline float2 SequencePoint(__constant const SamplingParams* sampling,
                                   __global const uint2* sequence, int k, uint2 shift) {
  const uint2 point = sequence[(uint)k % sampling->sequence];
  const uint2 shifted = sampling->digital ? point ^ shift : point + shift;
  return (float2)(UnitFloat(shifted.x), UnitFloat(shifted.y));
}

static inline Totals LightThesis(LUMINAIRE_ARGUMENTS, const Surface* surface,
                                 const ShadowRays* shadow, const LightTask* task, Windows windows,
                                 __global const uint2* sequence) {
  Totals totals = NoLight();
  const float total = TotalMass(luminaire, windows);
  if (!(total > 0.0f)) return totals;
  const int secant = sampling->secant, depth = sampling->depth;
  const float cells = (float)luminaire->basis.cells;
  Span one_row;  // field by field: Oclgrind loses aggregate initialisers
  one_row.begin = 0;
  one_row.end = 1;
  one_row.first = 1.0f;
  one_row.inner = one_row.last = 0.0f;
  const uint4 words = TaskWords(sampling, task, 0u);
  Allocation allocation = StartAllocation(sampling, task->samples, total, UnitFloat(words.x));
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      const float mass = windows.masses[(size_t)m * windows.stride];
      float weight;
      const int count = sampling->systematic ? Allot(&allocation, mass, &weight)
                                             : RoundedShare(sampling, task->samples, mass, total, &weight);
      if (count == 0) continue;
      const Window window = LoadWindow(luminaire, sat, surface, windows, m, i, j);
      weight *= ImageVisibility(luminaire, windows.seen, i, j);
      // The SAT's last row is cdf_m(s): one row of texels as high as the image.
      const Marginal marginal = MakeMarginal(
          window.sat, luminaire->axis[1].texels * window.sat_width, window.columns, one_row);
      const uint2 shift = sampling->decorrelated ? ImageShift(words, m) : (uint2)(0u, 0u);
      for (int k = 0; k < count; ++k) {
        const float2 xi = SequencePoint(sampling, sequence, k, shift);
        const Place column = LimitedMarginal(&marginal, window.columns, xi.x, secant, depth);
        const Conditional conditional =
            MakeConditional(window.sat, window.sat_width, column.texel, window.rows);
        const Place row = LimitedConditional(&conditional, window.rows, xi.y, secant, depth);
        const float2 y = (float2)(SupportCoordinate(&surface->x, window.columns, column, cells),
                                  SupportCoordinate(&surface->y, window.rows, row, cells));
        const float3 light = weight * BasisProduct(luminaire, y) *
                             Chroma(luminaire, images, m, column.texel, row.texel);
        AddLight(luminaire, surface, shadow, ToLamp(luminaire, surface, i, j, y), light, &totals);
      }
    }
  return totals;
}

__kernel void Thesis(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS, TASK_ARGUMENTS,
                     WINDOW_ARGUMENTS, __global const uint2* sequence, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  ClearShadowRays(&shadow);
  const LightTask task = TaskOf(sampling, tasks, pixel);
  luminaire += task.light;
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Windows windows = WINDOWS(item, pixel);
  const Totals totals = LightThesis(LUMINAIRE, &surface, &shadow, &task, windows, sequence);
  StoreTotals(luminaire, &surface, totals, &shadow, pixel, LIGHTING);
}
