// Sampling tables of a light field: one summed-area table per image, and reference positions for
// shadow maps (docs/theory.md 5).
//
// The SAT is 64-bit fixed point, scaled to the image's own total. Measured on 300 x 300 texels over
// 8 decades (tests/preprocess prints it), the worst relative error of the mass of a 4 x 4 window is
// 49 with float32 sums, 4e-7 with double and 0 with fixed point: every texel above 2^-38 of the
// total is a whole number of units, so its differences are exact, on every device, without fp64.
// Darker texels are rounded to half a quantum, 2^-62 of the total.
//
// Since differences are exact, the SAT holds the other tables too and none of them is stored:
//   marginal       cdf_m(s) = S[H][c] / S[H][W]           its last row
//   conditional    cdf_m(t|s): S[r][c+1] - S[r][c]        column c, from the top down
//   chroma         c_m(s) = C_m(s) / |C_m(s)|             read from the light field at the sample
//
// |C| is what a texel weighs, the luminance of its channels' magnitudes (summed_area.h): sampling
// takes C of any sign, draws in proportion to |C| and counts what it drew as C / |C|.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "luxfield/core/unset_vector.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/summed_area.h"

namespace luxfield::preprocess {

// Where the light of a knot cell leaves I: mean over the images whose basis overlaps the cell of
// the point where both CDFs are 1/2. All-zero images are left out; a cell without light has
// images = 0 and lies at (0, 0).
struct ReferencePosition {
  float s_m = 0, t_m = 0;
  int images = 0;

  bool operator==(const ReferencePosition&) const = default;
};

struct Tables {
  int width = 0, height = 0;            // texels of an image
  int grid_width = 0, grid_height = 0;  // W x H images, m = j * W + i
  int basis_cells = 0;                  // n
  std::string light_field_sha256;       // of the file the tables were made from

  // Image m: S[r][c] = sum of |C| (summed_area.h, rounded to float32) of rows < r and columns < c
  // in units of 2^-exponent[m]; (height + 1) x (width + 1) entries, row 0 and column 0 are 0, all
  // below 2^63.
  core::UnsetVector<std::uint64_t> sat;
  std::vector<int> exponent;  // 0 for an all-zero image

  // (W + n - 1) x (H + n - 1) cells, index cell_j * (W + n - 1) + cell_i.
  std::vector<ReferencePosition> reference;

  int count() const { return grid_width * grid_height; }
  std::size_t sat_size() const { return static_cast<std::size_t>(width + 1) * (height + 1); }
  const std::uint64_t* image(int m) const { return sat.data() + sat_size() * m; }
  // Sum over texels [c0, c1) x [r0, r1) of image m, in units; exact.
  std::uint64_t FixedPointSum(int m, int c0, int r0, int c1, int r1) const {
    const std::uint64_t* s = image(m);
    const std::size_t stride = width + 1;
    return s[r1 * stride + c1] - s[r1 * stride + c0] - s[r0 * stride + c1] + s[r0 * stride + c0];
  }
  double FixedPointToLuminance(int m, std::uint64_t units) const;
  // Sum of all texels of image m.
  double Total(int m) const {
    return FixedPointToLuminance(m, FixedPointSum(m, 0, 0, width, height));
  }
};

// Builds the tables of `field`, images in parallel. `name` (the file) and `sha256` are for messages
// and provenance. Throws InputError naming image and texel for a NaN or infinite C, and for an
// image whose sum exceeds float32; an all-zero image is legal.
Tables BuildTables(const lightfield::LightField& field, const std::string& name,
                   const std::string& sha256);

// InputError unless `tables` have the shape of `field` and were made from the file with this hash.
void CheckTables(const Tables& tables, const std::string& tables_name,
                 const lightfield::LuminaireGeometry& geometry,
                 const std::string& light_field_sha256);

}  // namespace luxfield::preprocess
