// Precomputed light importance sampling, the thesis' baseline: images and texels are drawn with
// density |C| over the whole luminaire, wherever the receiver is; what misses the windows is lost.
// A sample adds
//
//   delta^2 / z^3 h^2 (T_m / nbar_m) C / |C| Phi_m(y(s)) |dy / ds| (n . (u - p))+ V
//
// with T_m the sum of |C_m| and y(s) where the line from p through s meets F,
// |dy / ds| = 1 / step^2.
#include "luxfield/render/kernels/luminaire/window_lighting.clh"

// A whole axis of an image.
static inline Span WholeSpan(int texels) {
  const Span span = {.begin = 0,
                     .end = texels,
                     .first = 1.0f,
                     .inner = texels > 2 ? 1.0f : 0.0f,
                     .last = texels > 1 ? 1.0f : 0.0f};
  return span;
}

// An image to draw from, all of it.
typedef struct WholeImage {
  __global const ulong* sat;
  int sat_width;
  Span columns, rows;
  Marginal marginal;
} WholeImage;

static inline WholeImage MakeWholeImage(__global const ulong* sat, int width, int height) {
  WholeImage image;
  image.sat = sat;
  image.sat_width = SatStride(width);
  image.columns = WholeSpan(width);
  image.rows = WholeSpan(height);
  image.marginal = MakeMarginal(sat, image.sat_width, image.columns, image.rows);
  return image;
}

// A place with density |C|.
static inline void DrawPlace(const WholeImage* image, float2 xi, Place* column, Place* row) {
  DrawPlaces(image->sat, image->sat_width, &image->marginal, image->columns, image->rows, &xi, 1,
             column, row);
}

// y of a place, measured from the support's lower end at `knot`.
static inline float CoordinateFrom(const Axis* axis, Knot knot, Place place) {
  const float texels = (place.fraction - knot.fraction) - (knot.whole - (float)place.texel);
  return copysign(axis->inverse, (float)axis->step) * texels;
}

static inline float ImageTotal(__constant const LuminaireParams* luminaire,
                               __global const ulong* image, float scale) {
  const int width = luminaire->axis[0].texels, height = luminaire->axis[1].texels;
  return FromFixedPoint(image[(size_t)height * SatStride(width) + width]) * 0x1p-62f * scale;
}

static inline Totals LightPrecomputed(LUMINAIRE_ARGUMENTS, const Surface* surface,
                                      const ShadowRays* shadow, const LightTask* task,
                                      __global const uint* seen_by_pixel) {
  Totals totals = NoLight();
  // On I itself a point sees one point: nothing drawn on I has a chance to be it.
  if (fmax(surface->x.inverse, surface->y.inverse) > 1e12f) return totals;
  const float cells = (float)luminaire->basis.cells;
  const int width = luminaire->axis[0].texels, height = luminaire->axis[1].texels;
  const int images_count = luminaire->axis[0].count * luminaire->axis[1].count;
  const size_t sat_size = (size_t)SatStride(width) * (height + 1);
  float total = 0.0f;
  for (int m = 0; m < images_count; ++m)
    total += ImageTotal(luminaire, sat + m * sat_size, sat_scale[m]);
  if (!(total > 0.0f)) return totals;
  const uint4 words = TaskWords(sampling, task, 0u);
  Allocation allocation = StartAllocation(sampling, task->samples, total, UnitFloat(words.x));
  int m = 0;
  for (int j = 0; j < luminaire->axis[1].count; ++j)
    for (int i = 0; i < luminaire->axis[0].count; ++i, ++m) {
      __global const ulong* image_sat = sat + m * sat_size;
      float weight;
      const int count = Allot(&allocation, ImageTotal(luminaire, image_sat, sat_scale[m]), &weight);
      if (count == 0) continue;
      weight *= ImageVisibility(luminaire, seen_by_pixel, i, j);
      const WholeImage image = MakeWholeImage(image_sat, width, height);
      const Knot x_knot = MakeKnot(&surface->x, i), y_knot = MakeKnot(&surface->y, j);
      const uint2 shift = ImageShift(words, m);
      uint2 point = (uint2)(0u, 0u);
      for (int k = 0; k < count; ++k) {
        const float2 xi = ShiftPoint(point, shift);
        point = NextPoint(point, (uint)k);
        Place column, row;
        DrawPlace(&image, xi, &column, &row);
        const float2 y = (float2)(CoordinateFrom(&surface->x, x_knot, column),
                                  CoordinateFrom(&surface->y, y_knot, row));
        float3 light = (float3)(0.0f);
        if (y.x >= 0.0f && y.x < cells && y.y >= 0.0f && y.y < cells)
          light = weight * (BasisValue(&luminaire->basis, y.x) * surface->x.inverse) *
                  (BasisValue(&luminaire->basis, y.y) * surface->y.inverse) *
                  Chroma(luminaire, images, m, column.texel, row.texel);
        AddLight(luminaire, surface, shadow, ToLamp(luminaire, surface, i, j, y), light, &totals);
      }
    }
  return totals;
}

__kernel void Precomputed(LUMINAIRE_ARGUMENTS, SURFACE_ARGUMENTS, SHADOW_RAY_ARGUMENTS, TASK_ARGUMENTS,
                          WINDOW_ARGUMENTS, LIGHTING_ARGUMENTS) {
  const int item = get_global_id(0), pixel = sampling->begin + item;
  if (pixel >= sampling->end) return;
  const ShadowRays shadow = PixelShadowRays(SHADOW_RAYS, sampling->shadow_rays, item);
  ClearShadowRays(&shadow);
  const LightTask task = TaskOf(sampling, tasks, pixel);
  luminaire += task.light;
  Surface surface;
  if (!MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  const Totals totals =
      LightPrecomputed(LUMINAIRE, &surface, &shadow, &task, SeenByPixel(luminaire, seen, pixel));
  StoreTotals(luminaire, &surface, totals, &shadow, pixel, LIGHTING);
}
