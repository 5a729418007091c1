// Sampling tables of the knot cells on F (docs/theory.md 6, correction 3).
//
// Supports of basis functions overlap, cells of the knot lattice do not: seen from a receiver, each
// of the (W + n - 1) x (H + n - 1) cells has its own window on I, where only n^2 images shine. Cell
// (a, b) covers u0 + h [a, a + 1] x v0 + h [b, b + 1] and is drawn from with density in proportion
// to
//
//   Q_ab(s) = sqrt( integral over the cell of E(u->s)^2 du / h^2 ),   E = sum_m C_m(s) Phi_m(u),
//
// the density of s of the least second moment where u may lie anywhere in the cell. C may have
// signs: Q is above 0 wherever an image is not 0, also where E crosses 0, and needs no defensive
// part: |E| <= q Q everywhere in the cell, where q^2 is the largest value of the reproducing kernel
// of the cell's polynomials: q <= 1 for box, 4 for bilinear, 9 for quadratic and bspline2. Of
// colours E is the luminance where no C is negative. Where one is, a luminance may be 0 of channels
// that are not, and
//
//   Q_ab(s) = sqrt( sum over channels of w integral E^2 du / h^2 )
//
// with the luminance weights w (core/colour.h).
//
// Q is stored as the images' SAT is (summed_area.h): 64-bit fixed point, 2^62 of the cell's total,
// exact differences. Where a texel is lit its entry is at least one quantum, so the density covers
// the support whatever the dynamic range. 8 bytes per cell and texel: 76 MB for 13 x 11 cells of
// 256^2 texels, built in about half a core-second; they are not stored in files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "luxfield/core/unset_vector.h"
#include "luxfield/lightfield/light_field.h"

namespace luxfield::preprocess {

struct CellTables {
  int width = 0, height = 0;            // texels of an image
  int grid_width = 0, grid_height = 0;  // (W + n - 1) x (H + n - 1) cells, index b * grid_width + a

  // Cell k: S[r][c] = sum of Q of rows < r and columns < c in units of 2^-exponent[k];
  // (height + 1) x (width + 1) entries, all below 2^63.
  core::UnsetVector<std::uint64_t> sat;
  std::vector<int> exponent;  // 0 for a cell without light

  int count() const { return grid_width * grid_height; }
  std::size_t sat_size() const { return static_cast<std::size_t>(width + 1) * (height + 1); }
  const std::uint64_t* cell(int k) const { return sat.data() + sat_size() * k; }
};

// Builds the tables, cells in parallel. `name` (the file) is for messages. Throws InputError as
// BuildTables does, and for a cell whose sum exceeds float32.
CellTables BuildCellTables(const lightfield::LightField& field, const std::string& name);

}  // namespace luxfield::preprocess
