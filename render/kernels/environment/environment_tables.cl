// Sampling tables of an environment map, made anew for every frame by parallel sums
// (docs/theory.md 8).
//
//   q = max(0, Y(L) - c mean Y) dw,   prefix sums of q along each row, and of the rows' sums
//
// Luminances are added up in float32 as trees of fixed shape (relative error some 1e-6) to find the
// unit of energy; the tables themselves are integers of at least 2^-62 of the total each, whose
// sums and differences are exact: a texel below that is never drawn, and has density 0.
#include "luxfield/render/kernels/environment/environment_types.clh"
#include "luxfield/render/kernels/math/fixed_point.clh"
#include "luxfield/render/kernels/sample/totals.clh"

typedef struct TexelRow {
  int radiance, solid_angle;  // of its first texel in the radiance and solid angles of a cube map
} TexelRow;

static inline TexelRow LocateRow(__constant const EnvironmentParams* params, int row) {
  const int n = params->tile_size, size = params->face_size, tiles = params->tiles_per_side,
            tile = row / n, face = tile / (tiles * tiles), tile_row = tile / tiles % tiles,
            face_row = tile_row * n + row % n, column = tile % tiles * n;
  const TexelRow located = {(face * size + face_row) * size + column, face_row * size + column};
  return located;
}

// Adds up the values of a group's items; every item gets the sum.
static inline float SumOfGroup(float value, __local float* scratch) {
  const int item = get_local_id(0);
  scratch[item] = value;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int stride = get_local_size(0) / 2; stride > 0; stride /= 2) {
    if (item < stride) scratch[item] += scratch[item + stride];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const float sum = scratch[0];
  barrier(CLK_LOCAL_MEM_FENCE);
  return sum;
}

// The sum of the values of the items before this one (Hillis and Steele 1986); `total` gets that of
// all.
static inline ulong SumBefore(ulong value, __local ulong* scratch, ulong* total) {
  const int item = get_local_id(0), items = get_local_size(0);
  scratch[item] = value;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int distance = 1; distance < items; distance *= 2) {
    const ulong other = item >= distance ? scratch[item - distance] : 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    scratch[item] += other;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  const ulong sum = scratch[item];
  *total = scratch[items - 1];
  barrier(CLK_LOCAL_MEM_FENCE);
  return sum - value;
}

// A group per row: texels in the order of tiles, with their energy before compensation, and its
// sum.
__kernel __attribute__((reqd_work_group_size(kRowItems, 1, 1))) void EnvironmentRows(
    __constant const EnvironmentParams* params, __global const float* radiance,
    __global const float* solid_angles, __global float4* texels, __global float* row_sums) {
  __local float scratch[kRowItems];
  const int row = get_group_id(0), item = get_local_id(0), n = params->tile_size;
  const TexelRow from = LocateRow(params, row);
  float sum = 0.0f;
  for (int column = item; column < n; column += kRowItems) {
    const float3 colour = vload3(from.radiance + column, radiance);
    const float energy = Luminance(colour) * solid_angles[from.solid_angle + column];
    texels[(size_t)row * n + column] = (float4)(colour, energy);
    sum += energy;
  }
  sum = SumOfGroup(sum, scratch);
  if (item == 0) row_sums[row] = sum;
}

// One group: the unit of energy.
__kernel __attribute__((reqd_work_group_size(kTotalItems, 1, 1))) void EnvironmentTotal(
    __global const float* row_sums, int rows, __global EnvironmentTotals* totals) {
  __local float scratch[kTotalItems];
  float sum = 0.0f;
  for (int row = get_local_id(0); row < rows; row += kTotalItems) sum += row_sums[row];
  sum = SumOfGroup(sum, scratch);
  if (get_local_id(0) > 0) return;
  totals->mean = sum * (0.25f * M_1_PI_F);
  totals->exponent = sum > 0.0f ? ilogb(sum * 1.001f) + 1 : 0;  // the sum of units is not rounded
}

// A group per row: units and their sums from the row's start; texels[].w becomes the density of
// energy over a face, q N^2 / 4 in units of 2^exponent.
__kernel __attribute__((reqd_work_group_size(kRowItems, 1, 1))) void EnvironmentConditional(
    __constant const EnvironmentParams* params, __global const EnvironmentTotals* totals,
    __global const float* solid_angles, __global float4* texels, __global ulong* column_starts,
    __global ulong* row_starts) {
  __local ulong scratch[kRowItems];
  const int row = get_group_id(0), item = get_local_id(0), n = params->tile_size;
  const TexelRow from = LocateRow(params, row);
  const int part = (n + kRowItems - 1) / kRowItems, begin = min(item * part, n),
            end = min(begin + part, n);
  const float taken = params->compensation * totals->mean;
  const float per_face = 0.25f * (float)params->face_size * (float)params->face_size;
  ulong sum = 0;
  for (int column = begin; column < end; ++column) {
    const size_t texel = (size_t)row * n + column;
    const float energy =
        fmax(texels[texel].w - taken * solid_angles[from.solid_angle + column], 0.0f);
    const ulong units = convert_ulong(ldexp(energy, kEnergyBits - totals->exponent));
    column_starts[texel] = sum;
    texels[texel].w = FromFixedPoint(units) * 0x1p-62f * per_face;
    sum += units;
  }
  ulong total;
  const ulong before = SumBefore(sum, scratch, &total);
  for (int column = begin; column < end; ++column)
    column_starts[(size_t)row * n + column] += before;
  if (item == 0) row_starts[row] = total;
}

// One group: the rows' sums become sums of the rows before, with that of all rows at the end;
// energies of tiles in units of 2^exponent.
__kernel __attribute__((reqd_work_group_size(kTotalItems, 1, 1))) void EnvironmentMarginal(
    __constant const EnvironmentParams* params, __global ulong* row_starts,
    __global float* energies) {
  __local ulong scratch[kTotalItems];
  const int item = get_local_id(0), n = params->tile_size,
            tiles = 6 * params->tiles_per_side * params->tiles_per_side, rows = tiles * n,
            part = (rows + kTotalItems - 1) / kTotalItems, begin = min(item * part, rows),
            end = min(begin + part, rows);
  ulong sum = 0;
  for (int row = begin; row < end; ++row) sum += row_starts[row];
  ulong total;
  ulong before = SumBefore(sum, scratch, &total);
  for (int row = begin; row < end; ++row) {
    const ulong units = row_starts[row];
    row_starts[row] = before;
    before += units;
  }
  if (item == 0) row_starts[rows] = total;
  barrier(CLK_GLOBAL_MEM_FENCE);
  for (int tile = item; tile < tiles; tile += kTotalItems)
    energies[tile] = FromFixedPoint(row_starts[(tile + 1) * n] - row_starts[tile * n]) * 0x1p-62f;
}
