// The two planes, the grid and the lattice for one light field of a ray file.
#pragma once

#include <memory>
#include <optional>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/solve/ray_lines.h"

namespace luxfield::reconstruct {

struct RayPlaneOptions {
  lightfield::Basis basis = lightfield::Basis::Make(lightfield::BasisKind::kBspline2);
  int grid_width = 0, grid_height = 0;        // basis functions; 0: chosen
  int lattice_width = 0, lattice_height = 0;  // texels; 0: chosen
  std::optional<double> filter_z_m;           // z of F; absent: where the beam is narrowest
  std::optional<double> delta_m;              // absent: chosen
  double coverage = 1;  // least share of the lines' flux that both windows catch, in (0, 1]
};

struct RayPlanes {
  lightfield::LuminaireGeometry geometry;  // channels and unit are the caller's to set
  double filter_z_m = 0;
  double relative_window = 1;  // width of the window on F over that of 99 % of the flux
};

// The windows on F and I are flux quantiles per axis, (1 - coverage) / 8 left out on each side; the
// window on F fills the inner cells but for one cell on each side. What is not given - cells of F,
// texels, delta - is what makes LatticeRisk (ray_fit.h) smallest, found by coordinate descent over
// steps of about sqrt(2) (of 2 for delta) among those with
//
//   cells of the window x texels <= (sum flux)^2 / sum flux^2,    the number of independent rays,
//   4 x texel <= extent of the light on F,    so that neighbouring texels blend in any direction,
//   texel <= 0.3 delta, or 8 delta / sqrt(independent rays),    so that slopes stay apart.
//
// A texel t smears slopes by e = t / (sqrt(6) delta), standard deviation, per axis. Flux per slope
// falls as cos^3, so that at 45 degrees, where the fields of a cube meet, both spill over more of
// the intensity than they lose, 1.2 e of it at the seam itself.
//
// With a lattice given, delta is twice the extent on F; it is 0.1 m for a point.
//
// The lines are gone through three times, always in the same order, and up to a few times more
// where coverage is below 1 (flux_window.h); a sample of 100 000 of them is kept for the risk:
//
//   do
//     for (...) choice.Add(line);
//   while (choice.EndPass());
class RayPlaneChoice {
 public:
  explicit RayPlaneChoice(const RayPlaneOptions& options);  // InputError if one makes no sense
  ~RayPlaneChoice();
  RayPlaneChoice(RayPlaneChoice&&) noexcept;

  void Add(const RayLine& line);
  bool EndPass();  // whether another is needed; InputError if no line has flux
  const RayPlanes& planes() const;

 private:
  class Passes;
  std::unique_ptr<Passes> passes_;
};

// Throws InputError unless the grid has inner cells beside `margin` on each side.
void CheckInnerCells(const lightfield::BasisGrid& grid, int margin);

}  // namespace luxfield::reconstruct
