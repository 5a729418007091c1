// Which share of the light kept with a batch of shadow rays arrives, once they are traced
// (estimators/visible_share.h).
#include "luxfield/render/kernels/sample/totals.clh"

// Sums over samples x: of all and of the visible ones, and of those below 0 what they take away.
typedef struct VisibleSums {
  float3 light, taken, visible, visible_taken;
} VisibleSums;

static inline VisibleSums NoSums(void) {
  VisibleSums sums;
  sums.light = sums.taken = sums.visible = sums.visible_taken = (float3)(0.0f);
  return sums;
}

static inline void AddToSums(float3 light, bool visible, VisibleSums* sums) {
  const float3 taken = fmax(-light, (float3)(0.0f));
  sums->light += light;
  sums->taken += taken;
  if (!visible) return;
  sums->visible += light;
  sums->visible_taken += taken;
}

// Sums of |x|.
static inline float3 AllOf(const VisibleSums* sums) { return sums->light + 2.0f * sums->taken; }
static inline float3 SeenOf(const VisibleSums* sums) {
  return sums->visible + 2.0f * sums->visible_taken;
}

// Sums of squares of luminances, in units of that of AllOf: the square of a dim one would be 0.
typedef struct VisibleSquares {
  float all, visible;
} VisibleSquares;

static inline void AddToSquares(float3 light, bool visible, const VisibleSums* sums,
                                VisibleSquares* squares) {
  const float all = Luminance(AllOf(sums));
  const float part = all > 0.0f ? Luminance(light) / all : 0.0f;
  squares->all += part * part;
  if (visible) squares->visible += part * part;
}

// Writes the visible share and what it leaves out (estimators/visible_share.h). The variance is
// that of a ratio of sums, to first order; `scale` makes light of sums.
static inline void StoreShare(VisibleSums sums, VisibleSquares squares, int count, float scale,
                              __global float4* share) {
  const float3 all = AllOf(&sums), seen = SeenOf(&sums);
  const float luminance = Luminance(all);
  share[0] = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
  share[1] = (float4)(0.0f);
  if (!(luminance > 0.0f)) return;
  const float ratio = Luminance(seen) / luminance, n = (float)count;
  const float spread = (1.0f - 2.0f * ratio) * squares.visible + ratio * ratio * squares.all;
  const float3 v = (float3)(all.x > 0.0f ? seen.x / all.x : ratio,
                            all.y > 0.0f ? seen.y / all.y : ratio,
                            all.z > 0.0f ? seen.z / all.z : ratio);
  share[0] = (float4)(v, count > 1 ? fmax(spread, 0.0f) * (n / (n - 1.0f)) : 1.0f);
  share[1] = 2.0f * scale *
             (float4)(v * sums.taken - sums.visible_taken, Luminance(sums.taken));
}

// Visible shares of the irradiance and, where surfaces are glossy, of the reflected radiance, of
// pixels [begin, begin + count), item k being pixel begin + k.
__kernel void VisibleShare(int begin, int count, int capacity, SHADOW_RAY_ARGUMENTS,
                           __global const uchar* hidden, __global float4* share,
                           __global float4* shown_share, __global uint* samples) {
  const int item = get_global_id(0), pixel = begin + item;
  if (item >= count) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, capacity, item);
  __global const uchar* hidden_rays = hidden + (size_t)item * (size_t)capacity;
  const PendingPixel ending = *shadow.pending;
  VisibleSums light = NoSums();
#if GLOSSY
  VisibleSums shown = NoSums();
#endif
  for (int k = 0; k < shadow.range->end; ++k) {
    const Contribution sample = KeptContribution(&shadow, k);
    AddToSums(sample.light, !hidden_rays[k], &light);
#if GLOSSY
    AddToSums(sample.reflected, !hidden_rays[k], &shown);
#endif
  }
  VisibleSquares squares = {0.0f, 0.0f};
#if GLOSSY
  VisibleSquares shown_squares = {0.0f, 0.0f};
#endif
  for (int k = 0; k < shadow.range->end; ++k) {
    const Contribution sample = KeptContribution(&shadow, k);
    AddToSquares(sample.light, !hidden_rays[k], &light, &squares);
#if GLOSSY
    AddToSquares(sample.reflected, !hidden_rays[k], &shown, &shown_squares);
#endif
  }
  samples[pixel] += (uint)ending.samples;
  StoreShare(light, squares, ending.samples, ending.scale, share + 2 * pixel);
#if GLOSSY
  StoreShare(shown, shown_squares, ending.samples, ending.scale, shown_share + 2 * pixel);
#endif
}
