// Does the lamp's light reach the outer filters? (docs/theory.md 4, "Flux and moments")
//
// The outer n - 1 cells of the grid ramp from 1 to 0, so that sum_ij E_ij(s) is the flux density
// only where no light leaves through them, and less elsewhere. What can be seen of it is, per side,
//
//   g = sum E of the outer row of filters / sum E of the row next to it
//
// over all texels: 0.20 of a square that fills the interior cells to their border and 0.35 where it
// reaches a quarter of a cell into the ramp (`bspline2`; `bilinear` 0.5 and 0.72).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/measurements.h"

namespace luxfield::lightfield {

struct EdgeSide {
  std::string name;      // "-u", "+u", "-v", "+v"
  double ratio = 0;      // g; 0 where the next row has no light
  double share = 0;      // of all light, in the outer row
  bool reached = false;  // light in the ramps, above noise: the moments across it aren't known
};

struct EdgeLight {
  std::array<EdgeSide, 4> sides;
  // Sum E times the texels' area where all positions are known: at most the flux through them, and
  // equal to it where no side is reached. 0 where only levels are known.
  double measured_flux = 0;

  bool reached_u() const { return sides[0].reached || sides[1].reached; }
  bool reached_v() const { return sides[2].reached || sides[3].reached; }
  bool reached() const { return reached_u() || reached_v(); }
};

// The largest g of a side that is taken as dark: 0.35 for `bspline2`, 0.5 for `bilinear`. Others
// have no ramps (`box`) or no moments to lose (`quadratic`): absent.
std::optional<double> LargestEdgeRatio(const Basis& basis);

// From the light of every position, m = j * W + i, and its variance. A side is reached where its
// outer row exceeds that limit times the next by three standard deviations, and holds more than a
// thousandth of all light: what is lost of less than that matters less than least squares lose.
// Never along an axis whose filters have no moments to keep, nor with fewer than n filters.
EdgeLight FindEdgeLight(const BasisGrid& grid, std::span<const double> light,
                        std::span<const double> variance);

// The same of measurements with basis prints: sums over texels and channels where all positions of
// all measurements are known.
EdgeLight FindEdgeLight(std::span<const Measurements> measurements);

// One sentence for each side reached: which, how much, and what to do.
std::vector<std::string> EdgeWarnings(const EdgeLight& edges, const BasisGrid& grid);

}  // namespace luxfield::lightfield
