// The share of a luminaire's light that reaches receivers past what the patches' shadow maps show
// (render/lights/patch_shadows.h):
//
//   v(p) = sum_k V_k w_k / sum_k w_k,   w_k = B_k(a, tau) (n.(u_k - p))+
//
// Pixels are taken in tiles of four strips of sixteen. Where a tile's receivers lie in one plane,
// all texels that they look at are compared with that plane at once: a patch that none or all of
// them hide is decided for the tile, by what each pixel would find. The others are looked up pixel
// by pixel.
#include "luxfield/render/kernels/luminaire/patch_types.clh"
#include "luxfield/render/kernels/luminaire/pixel_vectors.clh"
#include "luxfield/render/kernels/luminaire/window.clh"
#include "luxfield/render/kernels/scene/bvh.clh"

enum { kStrips = 4, kRaysForContact = 4 };

// By how many texels' widths planes are lifted where a normal may be interpolated.
#define LIFT 0.3f
// What hides a receiver from nearer than so many texels' widths on its plane, or this share of its
// distance, throws a shadow that is too sharp for the map.
#define CONTACT 2.0f
#define CONTACT_SHARE 0.1f

// Pixels `first` to `end` of a row, luminaire frame.
typedef struct Strip {
  int first, end;
  int16 lit;  // those that may see light
  Vectors p, n;
  float16 w, tangent_x, tangent_y;  // 1 / z, x / z, y / z
  float16 rounding;                 // of the positions, m
} Strip;

// True if the windows of receivers at `a` meet the images along one axis.
static inline int16 MeetsImages(__constant const PatchParams* patches, int dimension, float16 a,
                                float16 shrink) {
  const float16 half_window = shrink * patches->extent[dimension];
  return a + half_window >= patches->image_low[dimension] &&
         a - half_window <= patches->image_high[dimension];
}

static inline void LoadStrip(__constant const LuminaireParams* luminaire,
                             __constant const PatchParams* patches,
                             __global const float4* positions, __global const float4* normals,
                             Strip* strip) {
  float16 hit, unused;
  const Vectors world = LoadVectors(positions, strip->first, strip->end, &hit);
  const Vectors p = PointsInFrame(luminaire, world);
  strip->lit = hit != 0.0f && p.z > 0.0f;
  if (!AnyOf(strip->lit)) return;
  const Vectors n =
      DirectionsInFrame(luminaire, LoadVectors(normals, strip->first, strip->end, &unused));
  const float16 z = fmax(p.z, luminaire->min_z), w = 1.0f / z, tau = luminaire->delta.hi * w,
                shrink = fabs(1.0f - tau);
  const float16 x = p.x - patches->centre[0], y = p.y - patches->centre[1];
  strip->lit &= MeetsImages(patches, 0, tau * x, shrink) &
                MeetsImages(patches, 1, tau * y, shrink) &
                (fabs(n.x) * patches->extent[0] + fabs(n.y) * patches->extent[1] >
                 n.x * x + n.y * y + n.z * z);
  strip->p = p;
  strip->p.z = z;
  strip->n = n;
  strip->w = w;
  strip->tangent_x = p.x * w;
  strip->tangent_y = p.y * w;
  strip->rounding =
      1e-6f + 1e-5f * fmax(fabs(world.x), fmax(fabs(world.y), fabs(world.z)));
}

static inline float3 LaneOf(const Vectors* v, int lane) {
  const float* x = (const float*)&v->x;
  const float* y = (const float*)&v->y;
  const float* z = (const float*)&v->z;
  return (float3)(x[lane], y[lane], z[lane]);
}

// The first lane of a mask that has any.
static inline int FirstOf(int16 mask) {
  int lanes[16];
  vstore16(mask, 0, lanes);
  int lane = 0;
  while (!lanes[lane]) ++lane;
  return lane;
}

// What the receivers of some strips have in common.
typedef struct Tile {
  bool plane;    // they lie in one
  float3 p, n;   // of one of them
  float lift;    // of the plane, m
  float2 low, high;     // tangents
  float nearest, farthest;  // 1 / z
} Tile;

// False if no receiver of the strips may see light.
static inline bool MakeTile(const Strip* strips, int count, Tile* tile) {
  int begin = 0;
  while (begin < count && !AnyOf(strips[begin].lit)) ++begin;
  if (begin == count) return false;
  const int lane = FirstOf(strips[begin].lit);
  tile->p = LaneOf(&strips[begin].p, lane);
  tile->n = LaneOf(&strips[begin].n, lane);
  tile->lift = ((const float*)&strips[begin].rounding)[lane];
  int16 off = 0;
  float16 low_x = MAXFLOAT, low_y = MAXFLOAT, high_x = -MAXFLOAT, high_y = -MAXFLOAT,
          nearest = 0.0f, farthest = MAXFLOAT;
  for (int k = begin; k < count; ++k) {
    const Strip* strip = strips + k;
    const int16 lit = strip->lit;
    if (!AnyOf(lit)) continue;
    const Vectors* p = &strip->p;
    const Vectors* n = &strip->n;
    const float16 turn_x = n->x - tile->n.x, turn_y = n->y - tile->n.y, turn_z = n->z - tile->n.z;
    const float16 apart = tile->n.x * (p->x - tile->p.x) + tile->n.y * (p->y - tile->p.y) +
                          tile->n.z * (p->z - tile->p.z);
    off |= lit & (turn_x * turn_x + turn_y * turn_y + turn_z * turn_z > 1e-12f ||
                  fabs(apart) > 1e-5f * p->z);
    low_x = select(low_x, fmin(low_x, strip->tangent_x), lit);
    low_y = select(low_y, fmin(low_y, strip->tangent_y), lit);
    high_x = select(high_x, fmax(high_x, strip->tangent_x), lit);
    high_y = select(high_y, fmax(high_y, strip->tangent_y), lit);
    nearest = select(nearest, fmax(nearest, strip->w), lit);
    farthest = select(farthest, fmin(farthest, strip->w), lit);
  }
  tile->plane = !AnyOf(off);
  tile->low = (float2)(SmallestOf(low_x), SmallestOf(low_y));
  tile->high = (float2)(LargestOf(high_x), LargestOf(high_y));
  tile->nearest = LargestOf(nearest);
  tile->farthest = SmallestOf(farthest);
  return true;
}

// 1 / depth of receivers' planes as seen from patches along (x, y, 1): a x + b y + c.
typedef struct Planes {
  float16 a, b, c;
} Planes;

// `height` is n.(u_k - p), counted as 0 where the patch lies behind the plane and sends no light.
static inline Planes MakePlanes(Vectors n, float16 height, float16 lift) {
  const float16 inverse = -1.0f / fmax(fmax(height - lift, 0.5f * height), 1e-20f);
  const Planes planes = {n.x * inverse, n.y * inverse, n.z * inverse};
  return planes;
}

// What the tile's pixels need of every patch where they lie in one plane.
typedef struct PatchLanes {
  float a[16], b[16], c[16];                         // of the plane
  int first_column[16], end_column[16];              // of the texels that they look at
  int first_row[16], end_row[16];
  int16 whole;  // all of these lie in the map, and are few
  int16 above;  // the patch lies in front of the plane
} PatchLanes;

static inline int16 FirstTexel(float16 low, float16 edge, float inverse_texel) {
  return convert_int16(floor(clamp((low - edge) * inverse_texel - 0.5f, -2.0f, 1e6f)));
}

static inline void MakePatchLanes(__constant const PatchParams* patches, const Tile* tile,
                                  PatchLanes* lanes) {
  enum { kMost = 32 };  // texels along a side
  const float16 x = vload16(0, patches->x), y = vload16(0, patches->y),
                low_x = vload16(0, patches->low_x), low_y = vload16(0, patches->low_y);
  const float3 p = tile->p, n = tile->n;
  const float16 height = n.x * (x - p.x) + n.y * (y - p.y) - n.z * p.z;
  const Vectors normal = {n.x, n.y, n.z};
  const Planes planes = MakePlanes(normal, height, tile->lift);
  vstore16(planes.a, 0, lanes->a);
  vstore16(planes.b, 0, lanes->b);
  vstore16(planes.c, 0, lanes->c);
  const float16 x0 = x * tile->farthest, x1 = x * tile->nearest, y0 = y * tile->farthest,
                y1 = y * tile->nearest;
  const float inverse = 1.0f / patches->texel;
  const int16 first_column = FirstTexel(tile->low.x - fmax(x0, x1), low_x, inverse),
              end_column = FirstTexel(tile->high.x - fmin(x0, x1), low_x, inverse) + 2,
              first_row = FirstTexel(tile->low.y - fmax(y0, y1), low_y, inverse),
              end_row = FirstTexel(tile->high.y - fmin(y0, y1), low_y, inverse) + 2;
  vstore16(first_column, 0, lanes->first_column);
  vstore16(end_column, 0, lanes->end_column);
  vstore16(first_row, 0, lanes->first_row);
  vstore16(end_row, 0, lanes->end_row);
  lanes->above = height > 0.0f;
  lanes->whole = first_column >= 0 && first_row >= 0 && end_column <= patches->size &&
                 end_row <= patches->size && end_column - first_column <= kMost &&
                 end_row - first_row <= kMost;
}

enum { kHidden, kSeen, kMixed };

// What the texels that the tile's pixels look at say of patch k.
static inline int SeenByTile(__constant const PatchParams* patches, __global const float* maps,
                             int k, const PatchLanes* lanes) {
  const float texel = patches->texel;
  const float16 numbers = (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  int16 hidden = 0, seen = 0;
  for (int column = lanes->first_column[k]; column < lanes->end_column[k]; column += 16) {
    const float16 x = patches->low_x[k] + (((float)column + 0.5f) + numbers) * texel;
    const int16 asked = numbers < (float)(lanes->end_column[k] - column);
    for (int row = lanes->first_row[k]; row < lanes->end_row[k]; ++row) {
      const float y = patches->low_y[k] + ((float)row + 0.5f) * texel;
      const float16 plane =
          fma(x, (float16)(lanes->a[k]), (float16)(lanes->b[k] * y + lanes->c[k]));
      const float16 map =
          LoadSixteen(maps + ((size_t)k * patches->size + row) * patches->size + column);
      const int16 ahead = map > plane;
      hidden |= ahead & asked;
      seen |= ~ahead & asked;
    }
  }
  if (!AnyOf(hidden)) return kSeen;
  return AnyOf(seen) ? kMixed : kHidden;
}

// Sixteen look-ups, each of a receiver in a patch's map.
typedef struct LookUps {
  float16 tangent_x, tangent_y;  // seen from the patch
  float16 low_x, low_y;          // the map's edges
  float16 w;                     // 1 / z
  Planes planes;
  int16 map;  // its first texel
} LookUps;

// How much each receiver sees: its four texels, compared with its plane, weighed bilinearly.
// Outside the map there is no light, and nothing is hidden. `contact`: where they differ by
// something as near to the receiver as some texels are wide on its plane, so that its shadow is
// sharper than the map.
static inline float16 LookUp(__constant const PatchParams* patches, __global const float* maps,
                             const LookUps* looks, int16* contact) {
  const float texel = patches->texel, inverse = 1.0f / texel, last = (float)(patches->size - 1);
  const float16 x = (looks->tangent_x - looks->low_x) * inverse - 0.5f,
                y = (looks->tangent_y - looks->low_y) * inverse - 0.5f;
  const int16 outside = !(x >= 0.0f && y >= 0.0f && x < last && y < last);
  const int16 column = convert_int16(clamp(x, 0.0f, last - 1.0f)),
              row = convert_int16(clamp(y, 0.0f, last - 1.0f));
  const float16 column_f = convert_float16(column), row_f = convert_float16(row),
                fx = x - column_f, fy = y - row_f;
  int first[16];
  vstore16(looks->map + row * patches->size + column, 0, first);
  float above[32], below[32];
  for (int k = 0; k < 16; ++k) {
    vstore2(vload2(0, maps + first[k]), k, above);
    vstore2(vload2(0, maps + first[k] + patches->size), k, below);
  }
  const float16 above0 = vload16(0, above), above1 = vload16(1, above), below0 = vload16(0, below),
                below1 = vload16(1, below);
  const Planes* plane = &looks->planes;
  const float16 at = plane->a * (looks->low_x + (column_f + 0.5f) * texel) +
                     plane->b * (looks->low_y + (row_f + 0.5f) * texel) + plane->c,
                along = plane->a * texel, down = plane->b * texel, least = 0.5f * looks->w;
  const float16 ahead[4] = {
      (float16)(above0.even, above1.even) - fmax(at, least),
      (float16)(above0.odd, above1.odd) - fmax(at + along, least),
      (float16)(below0.even, below1.even) - fmax(at + down, least),
      (float16)(below0.odd, below1.odd) - fmax(at + along + down, least)};
  const float16 near =
      CONTACT * (fabs(along) + fabs(down) + texel * looks->w) + CONTACT_SHARE * looks->w;
  int16 any_hidden = 0, all_hidden = -1, any_near = 0;
  float16 seen[4];
  for (int k = 0; k < 4; ++k) {
    const int16 hidden = ahead[k] > 0.0f;
    any_hidden |= hidden;
    all_hidden &= hidden;
    any_near |= hidden & (ahead[k] < near);
    seen[k] = select((float16)(1.0f), (float16)(0.0f), hidden);
  }
  *contact = any_hidden & ~all_hidden & any_near & ~outside;
  const float16 top = fma(fx, seen[1] - seen[0], seen[0]),
                bottom = fma(fx, seen[3] - seen[2], seen[2]);
  return select(fma(fy, bottom - top, top), (float16)(1.0f), outside);
}

// The scene, for rays.
typedef struct Rays {
  __global const BvhNode* nodes;
  __global const BvhTriangle* triangles;
  __global const float4* positions;
  __global const float4* normals;
} Rays;

// Replaces what a pixel sees of the patches in contact by rays to some of them: what lies so near
// hides all of them, or nearly.
static inline void TraceContact(__constant const LuminaireParams* luminaire,
                                __constant const PatchParams* patches, Rays rays, int pixel,
                                uint contact, float* visible, int stride) {
  __constant const DoubleFloat* o = luminaire->position;
  const float3 origin = (float3)(o[0].hi, o[1].hi, o[2].hi);
  const int count = popcount(contact), rays_asked = min(count, (int)kRaysForContact);
  int number = 0, traced = 0;
  float seen = 0.0f;
  for (int n = 0; n < kPatchCount; ++n) {
    // Along diagonals, so that every fourth of all patches lies in another row and column.
    const int k = (n & ~3) | ((n + (n >> 2)) & 3);
    if (!(contact >> k & 1u) || number++ != (2 * traced + 1) * count / (2 * rays_asked)) continue;
    const float3 point =
        origin + WorldFromLuminaire(luminaire, (float3)(patches->x[k], patches->y[k],
                                                        patches->nearest));
    ++traced;
    if (!Shadowed(rays.nodes, rays.triangles, rays.positions[pixel].xyz, rays.normals[pixel].xyz,
                  point))
      seen += 1.0f;
  }
  for (int k = 0; k < kPatchCount; ++k)
    if (contact >> k & 1u) visible[k * stride] = seen / (float)traced;
}

// The nodes beside x: the first, clamped, and how far x is from it to the next.
static inline float Node(__constant const PatchAxis* axis, float x, int* first) {
  const float position =
      clamp((x - axis->first) * axis->inverse_spacing, 0.0f, (float)(axis->nodes - 1));
  *first = min((int)position, axis->nodes - 2);
  return position - (float)*first;
}

// w_k of all patches.
static inline float16 Weights(__constant const LuminaireParams* luminaire,
                              __constant const PatchParams* patches, __global const float* light,
                              float3 p, float3 n) {
  const float tau = luminaire->delta.hi / p.z;
  int ix, iy, iz;
  const float fx = Node(&patches->axis[0], tau * (p.x - patches->centre[0]), &ix),
              fy = Node(&patches->axis[1], tau * (p.y - patches->centre[1]), &iy),
              fz = Node(&patches->axis[2], tau, &iz);
  const size_t line = (size_t)patches->axis[0].nodes * kPatchCount,
               slice = line * patches->axis[1].nodes;
  __global const float* node = light + iz * slice + iy * line + (size_t)ix * kPatchCount;
  float16 sum = 0.0f;
  for (int dz = 0; dz < 2; ++dz)
    for (int dy = 0; dy < 2; ++dy) {
      __global const float* row = node + dz * slice + dy * line;
      const float weight = (dz ? fz : 1.0f - fz) * (dy ? fy : 1.0f - fy);
      sum = fma((float16)(weight * (1.0f - fx)), LoadSixteen(row), sum);
      sum = fma((float16)(weight * fx), LoadSixteen(row + 16), sum);
    }
  const float16 x = vload16(0, patches->x), y = vload16(0, patches->y);
  const float16 height = n.x * (x - p.x) + n.y * (y - p.y) - n.z * p.z;
  return fmax(sum, 0.0f) * fmax(height, 0.0f);
}

// v of a receiver that sees `visible` of every patch.
static inline float ShareOf(__constant const LuminaireParams* luminaire,
                            __constant const PatchParams* patches, __global const float* light,
                            float3 p, float3 n, float16 visible) {
  const float16 weight = Weights(luminaire, patches, light, p, n);
  const float all = SumOf(weight);
  return all > 0.0f ? SumOf(weight * visible) / all : SumOf(visible) / (float)kPatchCount;
}

// What the receivers of a tile that lies in one plane find in the maps.
typedef struct PlaneTile {
  PatchLanes lanes;
  uint open, seen;  // patches that are not decided, and those that all pixels see
  bool smooth;      // the patches' light is as good as linear over a strip
} PlaneTile;

static inline void MakePlaneTile(__constant const LuminaireParams* luminaire,
                                 __constant const PatchParams* patches, __global const float* maps,
                                 const Tile* tile, PlaneTile* in_plane) {
  PatchLanes* lanes = &in_plane->lanes;
  MakePatchLanes(patches, tile, lanes);
  int whole[16], above[16];
  vstore16(lanes->whole, 0, whole);
  vstore16(lanes->above, 0, above);
  uint open = patches->lit, seen = 0u;
  for (int k = 0; k < kPatchCount; ++k) {
    if (!(open >> k & 1u)) continue;
    const int what = !above[k]  ? kSeen
                     : whole[k] ? SeenByTile(patches, maps, k, lanes)
                                : kMixed;
    if (what != kMixed) open &= ~(1u << k);
    if (what == kSeen) seen |= 1u << k;
  }
  in_plane->open = open;
  in_plane->seen = seen;
  const float delta = luminaire->delta.hi;
  const float2 across = delta * (tile->high - tile->low);
  in_plane->smooth = across.x * patches->axis[0].inverse_spacing < 1.0f &&
                     across.y * patches->axis[1].inverse_spacing < 1.0f &&
                     delta * (tile->nearest - tile->farthest) *
                             patches->axis[2].inverse_spacing < 1.0f;
}

// What each pixel of the strip sees of every patch: visible[patch][pixel].
static inline void LookUpOpen(__constant const LuminaireParams* luminaire,
                              __constant const PatchParams* patches, __global const float* maps,
                              const Strip* strip, const PlaneTile* tile, Rays rays,
                              float visible[kPatchCount * kPixels]) {
  uint contacts[kPixels];
  uint16 contact_bits = 0u;
  for (int k = 0; k < kPatchCount; ++k) {
    float16 part = tile->seen >> k & 1u ? 1.0f : 0.0f;
    if (tile->open >> k & 1u) {
      LookUps looks;
      looks.tangent_x = strip->tangent_x - patches->x[k] * strip->w;
      looks.tangent_y = strip->tangent_y - patches->y[k] * strip->w;
      looks.low_x = patches->low_x[k];
      looks.low_y = patches->low_y[k];
      looks.w = strip->w;
      looks.planes.a = tile->lanes.a[k];
      looks.planes.b = tile->lanes.b[k];
      looks.planes.c = tile->lanes.c[k];
      looks.map = k * patches->size * patches->size;
      int16 contact;
      part = LookUp(patches, maps, &looks, &contact);
      contact_bits |= as_uint16(contact & strip->lit) & (uint16)(1u << k);
    }
    vstore16(part, k, visible);
  }
  if (!AnyOf(contact_bits != 0u)) return;
  vstore16(contact_bits, 0, contacts);
  for (int i = 0; i < kPixels; ++i)
    if (contacts[i])
      TraceContact(luminaire, patches, rays, strip->first + i, contacts[i], visible + i, kPixels);
}

// Of a strip of a tile whose receivers lie in one plane.
static inline float16 SharesInPlane(__constant const LuminaireParams* luminaire,
                                    __constant const PatchParams* patches,
                                    __global const float* maps, __global const float* light,
                                    const Strip* strip, const PlaneTile* tile, Rays rays) {
  if (!tile->open && !(tile->seen && patches->lit & ~tile->seen))
    return select((float16)(0.0f), (float16)(tile->seen ? 1.0f : 0.0f), strip->lit);
  float visible[kPatchCount * kPixels];
  LookUpOpen(luminaire, patches, maps, strip, tile, rays, visible);
  int lit[kPixels];
  vstore16(strip->lit, 0, lit);
  if (!tile->smooth) {
    float shares[kPixels];
    for (int i = 0; i < kPixels; ++i) {
      float of_pixel[kPatchCount];
      for (int k = 0; k < kPatchCount; ++k) of_pixel[k] = visible[k * kPixels + i];
      shares[i] = lit[i] ? ShareOf(luminaire, patches, light, LaneOf(&strip->p, i),
                                   LaneOf(&strip->n, i), vload16(0, of_pixel))
                         : 0.0f;
    }
    return vload16(0, shares);
  }
  int begin = 0, last = kPixels - 1;
  while (!lit[begin]) ++begin;
  while (!lit[last]) --last;
  float from[kPatchCount], step[kPatchCount];
  const float16 first = Weights(luminaire, patches, light, LaneOf(&strip->p, begin),
                                LaneOf(&strip->n, begin)),
                end = Weights(luminaire, patches, light, LaneOf(&strip->p, last),
                              LaneOf(&strip->n, last));
  vstore16(first, 0, from);
  vstore16((end - first) / (float)max(last - begin, 1), 0, step);
  const float16 numbers = (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const float16 along = numbers - (float)begin;
  float16 all = 0.0f, part = 0.0f, mean = 0.0f;
  for (int k = 0; k < kPatchCount; ++k) {
    const float16 weight = fma(along, (float16)(step[k]), (float16)(from[k])),
                  seen = vload16(k, visible);
    all += weight;
    part = fma(weight, seen, part);
    mean += seen / (float)kPatchCount;
  }
  const float16 share = select(mean, clamp(part / all, 0.0f, 1.0f), all > 0.0f);
  return select((float16)(0.0f), share, strip->lit);
}

// Of one receiver, all patches at once.
static inline float ShareAlone(__constant const LuminaireParams* luminaire,
                               __constant const PatchParams* patches, __global const float* maps,
                               __global const float* light, const Strip* strip, int lane,
                               Rays rays) {
  const float3 p = LaneOf(&strip->p, lane), n = LaneOf(&strip->n, lane);
  const float w = 1.0f / p.z, lift = ((const float*)&strip->rounding)[lane] +
                                     LIFT * patches->texel * p.z;
  const float16 x = vload16(0, patches->x), y = vload16(0, patches->y);
  const float16 height = n.x * (x - p.x) + n.y * (y - p.y) - n.z * p.z;
  const int16 numbers = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const Vectors normal = {n.x, n.y, n.z};
  LookUps looks;
  looks.tangent_x = (p.x - x) * w;
  looks.tangent_y = (p.y - y) * w;
  looks.low_x = vload16(0, patches->low_x);
  looks.low_y = vload16(0, patches->low_y);
  looks.w = w;
  looks.planes = MakePlanes(normal, height, lift);
  looks.map = numbers * (patches->size * patches->size);
  int16 contact;
  const float16 seen = LookUp(patches, maps, &looks, &contact);
  const int16 lit = (((int16)((int)patches->lit) >> numbers) & 1) != 0;
  const int16 counted = lit & (height > 0.0f);
  float visible[kPatchCount];
  vstore16(select((float16)(1.0f), seen, counted), 0, visible);
  contact &= counted;
  if (AnyOf(contact)) {
    int bits[16];
    uint all = 0u;
    vstore16(contact, 0, bits);
    for (int k = 0; k < kPatchCount; ++k) all |= bits[k] ? 1u << k : 0u;
    TraceContact(luminaire, patches, rays, strip->first + lane, all, visible, 1);
  }
  const float16 part = vload16(0, visible);
  if (!AnyOf(counted & (part != 1.0f))) return 1.0f;
  if (!AnyOf(counted & (part != 0.0f))) return 0.0f;
  return ShareOf(luminaire, patches, light, p, n, part);
}

// Of a strip whose receivers lie in no plane.
static inline float16 SharesAlone(__constant const LuminaireParams* luminaire,
                                  __constant const PatchParams* patches, __global const float* maps,
                                  __global const float* light, const Strip* strip, Rays rays) {
  float shares[kPixels];
  int lit[kPixels];
  vstore16(strip->lit, 0, lit);
  for (int i = 0; i < kPixels; ++i)
    shares[i] = lit[i] ? ShareAlone(luminaire, patches, maps, light, strip, i, rays) : 0.0f;
  return vload16(0, shares);
}

// share[pixel] = v(p), 0 where no light arrives. Item (tile): tile_width is 16, or 64 where the
// pixels are no picture.
__kernel void PatchShares(__constant const LuminaireParams* luminaire,
                          __constant const PatchParams* patches, __global const float* maps,
                          __global const float* light, __global const float4* positions,
                          __global const float4* normals, int width, int height, int tile_width,
                          __global const BvhNode* nodes, __global const BvhTriangle* triangles,
                          __global float* share) {
  const int across = (width + tile_width - 1) / tile_width,
            tile_height = kStrips * kPixels / tile_width;
  const int item = get_global_id(0), left = item % across * tile_width,
            top = item / across * tile_height;
  if (top >= height) return;
  Strip strips[kStrips];
  for (int k = 0; k < kStrips; ++k) {
    const int row = top + k * kPixels / tile_width, column = left + k * kPixels % tile_width;
    const bool inside = row < height && column < width;
    strips[k].first = row * width + column;
    strips[k].end = inside ? (row + 1) * width : strips[k].first;
    strips[k].lit = 0;
    if (inside) LoadStrip(luminaire, patches, positions, normals, strips + k);
  }
  Tile tile;
  PlaneTile in_plane;
  const bool any_lit = MakeTile(strips, kStrips, &tile), together = any_lit && tile.plane;
  if (together) MakePlaneTile(luminaire, patches, maps, &tile, &in_plane);
  const Rays rays = {nodes, triangles, positions, normals};
  for (int k = 0; k < kStrips; ++k) {
    float16 shares = 0.0f;
    if (AnyOf(strips[k].lit)) {
      if (!together) {
        MakeTile(strips + k, 1, &tile);
        if (tile.plane) MakePlaneTile(luminaire, patches, maps, &tile, &in_plane);
      }
      shares = tile.plane ? SharesInPlane(luminaire, patches, maps, light, strips + k, &in_plane,
                                          rays)
                          : SharesAlone(luminaire, patches, maps, light, strips + k, rays);
    }
    StoreFloats(shares, share, strips[k].first, strips[k].end);
  }
}
