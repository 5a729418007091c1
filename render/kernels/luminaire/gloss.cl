// Reflected light without samples (docs/theory.md 7.4): pieces of light, each with its exact
// moments and the BRDF towards its centroid. Where the BRDF hardly varies over the lamp, pieces are
// blocks of images (image_blocks.clh); else they are the u-cells of F, cut into parts where the
// lobe is narrow, with what all images send through them.
//
//   L = sum over pieces  delta^2 / z^3 h^2 f_r(w) (k M00 + n_x h M10 + n_y h M01),
//   M_ab = integral over the piece of sum_m C_m(s(y)) Phi_m(y) (x - x_c)^a (y - y_c)^b dx dy,
//   k = n . (u_c - p),   w towards the centroid u_c + h (M10, M01) / M00
//
// The bracket is exact, so is L for a constant f_r. Otherwise f_r (n.w) |u - p| is taken as linear
// over the piece: the error is half the trace of its Hessian times the piece's covariance, at most
// side^2 / 24 times its Laplacian for even light.
#include "luxfield/render/kernels/luminaire/horizon.clh"
#include "luxfield/render/kernels/luminaire/image_blocks.clh"

enum { kStripTexels = 16, kMostParts = 32 };

// Part (a, b) of the parts^2 of u-cell (i, j); x_c and y_c are its middle.
typedef struct Piece {
  int i, j, parts, a, b;
} Piece;

static inline Knot MakePartKnot(const Axis* axis, int cell, int part, int parts) {
  if (part == parts) return MakeKnot(axis, cell + 1);
  return KnotAt(axis->first + cell * axis->step + (axis->step / parts) * part);
}

// One axis of a piece: part `part` of `parts` of a u-cell, between two knots.
typedef struct PieceSide {
  const Axis* axis;
  int cell, part, parts;
  Knot near, far;
} PieceSide;

static inline PieceSide MakePieceSide(const Axis* axis, int cell, int part, int parts) {
  PieceSide side;
  side.axis = axis;
  side.cell = cell;
  side.part = part;
  side.parts = parts;
  side.near = MakePartKnot(axis, cell, part, parts);
  side.far = MakePartKnot(axis, cell, part + 1, parts);
  return side;
}

// Of neighbouring texels: integral B dy and, about the piece's middle, integral (y - y_c) B dy.
typedef struct LaneMoments {
  Lanes zeroth, moment;
} LaneMoments;

// Of the texels `first` .. for the basis function that begins at knot `function`.
static inline LaneMoments PieceWeights(__constant const BasisParams* basis, const PieceSide* side,
                                       int function, int first) {
  const float length = 1.0f / (float)side->parts;
  const bool forward = side->axis->step >= 0;
  const SeenPart seen = SeePart(side->axis, forward ? side->near : side->far,
                                forward ? side->far : side->near, (float)first, length);
  // B is evaluated from that end of the cell which lies nearer to the rim of the support.
  const int k = side->cell - function;
  const bool rising = 2 * k < basis->cells;
  const Lanes x = (rising ? seen.from_near : seen.from_far) +
                  (float)(rising ? side->part : side->parts - 1 - side->part) * length;
  const Lanes second = seen.width * seen.width * (1.0f / 12.0f);
  Lanes mean, slope;
  EvaluateCell(rising ? basis->left[k] : basis->right[k], x, second, &mean, &slope);
  const Lanes from_middle = seen.from_near - 0.5f * length;
  LaneMoments weights;
  weights.zeroth = seen.width * mean;
  weights.moment = seen.width * (from_middle * mean + (rising ? second : -second) * slope);
  return weights;
}

// Weights of the rows of a piece for the basis functions over it; kept while pieces of one strip
// follow each other.
typedef struct Strip {
  int j, parts, b, first;  // what it holds
  float zeroth[kMaxCells][kStripTexels], moment[kMaxCells][kStripTexels];
} Strip;

static inline void FillStrip(__constant const LuminaireParams* luminaire, const Piece* piece,
                             const PieceSide* side, int first, Strip* strip) {
  if (strip->j == piece->j && strip->parts == piece->parts && strip->b == piece->b &&
      strip->first == first)
    return;
  strip->j = piece->j;
  strip->parts = piece->parts;
  strip->b = piece->b;
  strip->first = first;
  const int cells = luminaire->basis.cells;
  for (int k = 0; k < cells; ++k) {
    const int function = piece->j - k;
    if (function < 0 || function >= luminaire->axis[1].count) continue;
    for (int e = 0; e < kStripTexels; e += kLanes) {
      const LaneMoments weights = PieceWeights(&luminaire->basis, side, function, first + e);
      ((UnalignedLanes*)(strip->zeroth[k] + e))->lanes = weights.zeroth;
      ((UnalignedLanes*)(strip->moment[k] + e))->lanes = weights.moment;
    }
  }
}

// The moments of a piece.
static inline Moments SumPiece(__constant const LuminaireParams* luminaire,
                               __global const float* images, const Surface* surface,
                               const Piece* piece, Strip* strip) {
  Moments sum;
  for (int channel = 0; channel < 3; ++channel)
    sum.m00[channel] = sum.m10[channel] = sum.m01[channel] = 0.0f;
  const PieceSide x = MakePieceSide(&surface->x, piece->i, piece->a, piece->parts),
                  y = MakePieceSide(&surface->y, piece->j, piece->b, piece->parts);
  const int2 columns = WindowTexels(x.near, x.far, luminaire->axis[0].texels),
             rows = WindowTexels(y.near, y.far, luminaire->axis[1].texels);
  const int cells = luminaire->basis.cells, channels = luminaire->channels;
  const size_t stride = luminaire->row_stride, plane = luminaire->axis[1].texels * stride;
  for (int r_begin = rows.x; r_begin < rows.y; r_begin += kStripTexels) {
    const int r_count = min((int)kStripTexels, rows.y - r_begin);
    FillStrip(luminaire, piece, &y, r_begin, strip);
    for (int c = columns.x; c < columns.y; c += kLanes)
      for (int k = 0; k < cells; ++k) {
        const int i = piece->i - k;
        if (i < 0 || i >= luminaire->axis[0].count) continue;
        const LaneMoments of_columns = PieceWeights(&luminaire->basis, &x, i, c);
        for (int channel = 0; channel < channels; ++channel) {
          Lanes column0 = 0.0f, column1 = 0.0f;
          for (int l = 0; l < cells; ++l) {
            const int j = piece->j - l;
            if (j < 0 || j >= luminaire->axis[1].count) continue;
            const size_t m = (size_t)j * luminaire->axis[0].count + i;
            __global const float* texel =
                images + (m * channels + channel) * plane + r_begin * stride + c;
            for (int r = 0; r < r_count; ++r, texel += stride) {
              const Lanes value = LoadLanes(texel);
              column0 = fma(value, (Lanes)(strip->zeroth[l][r]), column0);
              column1 = fma(value, (Lanes)(strip->moment[l][r]), column1);
            }
          }
          sum.m00[channel] += SumLanes(of_columns.zeroth * column0);
          sum.m10[channel] += SumLanes(of_columns.moment * column0);
          sum.m01[channel] += SumLanes(of_columns.zeroth * column1);
        }
      }
  }
  return sum;
}

// Adds what a piece of light sends to the pixel, energy[channel] (irradiance / FluxScale) arriving
// from `from`, in h from the lower corner of all supports.
static inline void AddEnergy(__constant const LuminaireParams* luminaire, const Surface* surface,
                             const float* energy, const float2* from, Totals* totals) {
  float light[3] = {0.0f, 0.0f, 0.0f}, shown[3] = {0.0f, 0.0f, 0.0f};
  for (int channel = 0; channel < luminaire->channels; ++channel) {
    const float3 f = EvaluateBrdf(&surface->brdf,
                                  normalize(ToLamp(luminaire, surface, 0, 0, from[channel])));
    const float factor[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; ++c)
      if (luminaire->channels == 1 || c == channel) {
        light[c] = energy[channel];
        shown[c] = energy[channel] * factor[c];
      }
  }
  totals->visible += (float3)(light[0], light[1], light[2]);
  totals->reflected += (float3)(shown[0], shown[1], shown[2]);
}

// Where in h a centroid `at` of a piece lies, in pieces about its middle. Negative coefficients may
// pull it out of the piece.
static inline float2 PlaceOf(const Piece* piece, float2 at) {
  const float part = 1.0f / (float)piece->parts;
  return (float2)((float)piece->i, (float)piece->j) +
         part * ((float2)((float)piece->a + 0.5f, (float)piece->b + 0.5f) +
                 clamp(at, (float2)(-0.5f), (float2)(0.5f)));
}

// A block of images wholly above the horizon, which `horizon` gives at the lower corner of all
// supports. False, and nothing is added, where negative coefficients leave no centroid in it.
static inline bool LightBlock(__constant const LuminaireParams* luminaire,
                              __global const float* images, const Surface* surface,
                              const Horizon* horizon, const BlockSide* x, const BlockSide* y,
                              Totals* totals) {
  const float2 middle = (float2)(x->middle, y->middle);
  const float centre =
      horizon->at_corner + middle.x * horizon->along_x + middle.y * horizon->along_y;
  Moments moments;
  float energy[3];
  float2 from[3];
  for (int channel = 0; channel < luminaire->channels; ++channel) {
    SumChannel(luminaire, images, x, y, channel, &moments);
    const float m00 = moments.m00[channel], m10 = moments.m10[channel], m01 = moments.m01[channel];
    if (fabs(m10) > 0.5f * x->width * fabs(m00) || fabs(m01) > 0.5f * y->width * fabs(m00))
      return false;
    energy[channel] = centre * m00 + horizon->along_x * m10 + horizon->along_y * m01;
    from[channel] = m00 != 0.0f ? middle + (float2)(m10, m01) / m00 : middle;
  }
  AddEnergy(luminaire, surface, energy, from, totals);
  return true;
}

// All light, by blocks of at most `most` images along each axis; false where a block has no
// centroid, or sees more texels than its weights hold.
static inline bool LightByBlocks(__constant const LuminaireParams* luminaire,
                                 __global const float* images, const Surface* surface, int most,
                                 Totals* totals) {
  if (!SupportsFit(luminaire, &surface->x) || !SupportsFit(luminaire, &surface->y)) return false;
  const Horizon horizon =
      HorizonAtBasis(luminaire, &surface->receiver, &surface->x, &surface->y, 0, 0);
  const int columns = luminaire->axis[0].count, rows = luminaire->axis[1].count;
  const int across = (columns + most - 1) / most, down = (rows + most - 1) / most;
  BlockSide x, y;
  for (int a = 0; a < across; ++a) {
    const int i = a * columns / across;
    FillBlockSide(luminaire, &surface->x, 0, i, (a + 1) * columns / across - i, &x);
    for (int b = 0; b < down; ++b) {
      const int j = b * rows / down;
      FillBlockSide(luminaire, &surface->y, 1, j, (b + 1) * rows / down - j, &y);
      if (!LightBlock(luminaire, images, surface, &horizon, &x, &y, totals)) return false;
    }
  }
  return true;
}

// A piece wholly above the horizon.
static inline void LightPiece(__constant const LuminaireParams* luminaire,
                              __global const float* images, const Surface* surface,
                              const Horizon* horizon, const Piece* piece, Strip* strip,
                              Totals* totals) {
  const Moments moments = SumPiece(luminaire, images, surface, piece, strip);
  const float part = 1.0f / (float)piece->parts;
  const float centre = horizon->at_corner + part * (((float)piece->a + 0.5f) * horizon->along_x +
                                                    ((float)piece->b + 0.5f) * horizon->along_y);
  float energy[3];
  float2 from[3];
  for (int channel = 0; channel < luminaire->channels; ++channel) {
    const float m00 = moments.m00[channel], m10 = moments.m10[channel], m01 = moments.m01[channel];
    energy[channel] = centre * m00 + horizon->along_x * m10 + horizon->along_y * m01;
    from[channel] = PlaceOf(piece, m00 != 0.0f ? (float2)(m10, m01) * ((float)piece->parts / m00)
                                               : (float2)(0.0f, 0.0f));
  }
  AddEnergy(luminaire, surface, energy, from, totals);
}

// A piece that the horizon cuts: exact energy texel by texel, its centroid from the middles of the
// texels' lit parts.
static inline void LightCutPiece(__constant const LuminaireParams* luminaire,
                                 __global const float* images, const Surface* surface,
                                 const Horizon* horizon, const Piece* piece, Totals* totals) {
  __constant const BasisParams* basis = &luminaire->basis;
  const float part = 1.0f / (float)piece->parts;
  const float2 corner = part * (float2)((float)piece->a, (float)piece->b);
  const int2 columns = WindowTexels(MakeKnot(&surface->x, piece->i),
                                    MakeKnot(&surface->x, piece->i + 1), luminaire->axis[0].texels),
             rows = WindowTexels(MakeKnot(&surface->y, piece->j),
                                 MakeKnot(&surface->y, piece->j + 1), luminaire->axis[1].texels);
  const size_t stride = luminaire->row_stride, plane = luminaire->axis[1].texels * stride;
  float energy[3] = {0.0f, 0.0f, 0.0f};
  float2 from[3] = {(float2)(0.0f), (float2)(0.0f), (float2)(0.0f)};
  for (int row = rows.x; row < rows.y; ++row) {
    const float2 y =
        clamp(SupportInterval(&surface->y, piece->j, (float)row, 1.0f), corner.y, corner.y + part);
    for (int column = columns.x; column < columns.y && y.x < y.y; ++column) {
      const float2 x = clamp(SupportInterval(&surface->x, piece->i, (float)column, 1.0f), corner.x,
                             corner.x + part);
      if (!(x.x < x.y) || SideOf(horizon, x.x, x.y, y.x, y.y) == kBelow) continue;
      const float2 middle =
          ((float2)(x.x + x.y, y.x + y.y) * 0.5f - corner) * (float)piece->parts - 0.5f;
      float row_energy[3] = {0.0f, 0.0f, 0.0f};
      for (int l = 0; l < basis->cells; ++l)
        for (int k = 0; k < basis->cells; ++k) {
          const int i = piece->i - k, j = piece->j - l;
          if (i < 0 || i >= luminaire->axis[0].count || j < 0 || j >= luminaire->axis[1].count)
            continue;
          const float weight = ClippedCell(basis->left[k], basis->left[l], x.x, x.y, y.x, y.y,
                                           horizon->at_corner, horizon->along_x, horizon->along_y);
          __global const float* texel =
              images + ((size_t)j * luminaire->axis[0].count + i) * luminaire->channels * plane +
              row * stride + column;
          for (int channel = 0; channel < luminaire->channels; ++channel)
            row_energy[channel] += weight * texel[channel * plane];
        }
      for (int channel = 0; channel < luminaire->channels; ++channel) {
        energy[channel] += row_energy[channel];
        from[channel] += row_energy[channel] * middle;
      }
    }
  }
  for (int channel = 0; channel < luminaire->channels; ++channel) {
    if (energy[channel] != 0.0f) from[channel] /= energy[channel];
    from[channel] = PlaceOf(piece, from[channel]);
  }
  AddEnergy(luminaire, surface, energy, from, totals);
}

// Into how many parts along each axis a u-cell is cut for an error of `max_error` times what it
// shows.
static inline int PartsOfCell(__constant const LuminaireParams* luminaire, const Surface* surface,
                              int i, int j, float max_error) {
  const float3 to_lamp = ToLamp(luminaire, surface, i, j, (float2)(0.5f, 0.5f));
  // From the nearest point of the cell: before F a cell may fill the hemisphere.
  const float h = luminaire->axis[0].spacing.hi;
  const float3 nearest = (float3)(fmax(fabs(to_lamp.xy) - 0.5f * h, (float2)(0.0f)), to_lamp.z);
  const float side = h / length(nearest);
  const float curvature =
      RelativeCurvature(&surface->brdf, normalize(to_lamp), 0.7071f * side, 0.0f);
  return clamp((int)ceil(side * sqrt(curvature / (24.0f * max_error))), 1, (int)kMostParts);
}

// All light, by u-cells and their parts.
static inline void LightByCells(__constant const LuminaireParams* luminaire,
                                __global const float* images, const Surface* surface,
                                float max_error, Totals* totals) {
  Strip strip;
  strip.parts = 0;
  const int ramp = luminaire->basis.cells - 1;
  for (int j = 0; j < luminaire->axis[1].count + ramp; ++j)
    for (int i = 0; i < luminaire->axis[0].count + ramp; ++i) {
      const Horizon horizon =
          HorizonAtBasis(luminaire, &surface->receiver, &surface->x, &surface->y, i, j);
      if (SideOf(&horizon, 0.0f, 1.0f, 0.0f, 1.0f) == kBelow) continue;
      const int parts = PartsOfCell(luminaire, surface, i, j, max_error);
      const float part = 1.0f / (float)parts;
      for (int b = 0; b < parts; ++b)
        for (int a = 0; a < parts; ++a) {
          const Piece piece = {i, j, parts, a, b};
          const int side = SideOf(&horizon, part * (float)a, part * (float)(a + 1), part * (float)b,
                                  part * (float)(b + 1));
          if (side == kAbove)
            LightPiece(luminaire, images, surface, &horizon, &piece, &strip, totals);
          else if (side == kCut)
            LightCutPiece(luminaire, images, surface, &horizon, &piece, totals);
        }
    }
}

// Adds irradiance and reflected radiance of every pixel. `share` and `shown_share` (may be null):
// what of either is visible (estimators/visible_share.h).
__kernel void Gloss(__constant const LuminaireParams* luminaire, __global const float* images,
                    SURFACE_ARGUMENTS, int pixel_count, float max_error,
                    __global const float4* share, __global const float4* shown_share,
                    __global float4* irradiance, __global float4* reflected,
                    __global float* variance) {
  const int pixel = get_global_id(0);
  Surface surface;
  if (pixel >= pixel_count || !MakeSurface(luminaire, SURFACE(pixel), &surface)) return;
  Totals totals = NoLight();
  const int side = WholeHorizon(luminaire, &surface.receiver),
            most = side == kAbove ? ImagesOfBlock(luminaire, &surface, max_error) : 0;
  if (most == 0 || !LightByBlocks(luminaire, images, &surface, most, &totals)) {
    totals = NoLight();
    if (side != kBelow) LightByCells(luminaire, images, &surface, max_error, &totals);
  }
  const float scale = FluxScale(luminaire, surface.receiver.p.z);
  float3 visible = scale * totals.visible, shown = scale * totals.reflected;
  if (share) {
    const float4 of_visible = share[2 * pixel], of_shown = shown_share[2 * pixel],
                 taken = shown_share[2 * pixel + 1];
    const float luminance = Luminance(shown) + taken.w;
    variance[pixel] += luminance * luminance * of_shown.w;
    visible = visible * of_visible.xyz + share[2 * pixel + 1].xyz;
    shown = shown * of_shown.xyz + taken.xyz;
  }
  irradiance[pixel].xyz += visible;
  reflected[pixel].xyz += shown;
}
