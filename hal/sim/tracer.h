// Light through a filter onto the image plane: the forward model of the rig (docs/theory.md 3), by
// quadrature.
//
//   E(s) = integral_F L(u->s) cos^4(theta) / delta^2 * T(u - c) du
//
// Composite Gauss-Legendre over u-cells of a lattice on F; with cells on the knots of filters and
// lamp it is exact (3 nodes per cell and axis: polynomials up to degree 5) for lamps in the span of
// a basis. Nothing here knows a Gram matrix.
#pragma once

#include <functional>
#include <vector>

#include "luxfield/hal/sim/lamp.h"
#include "luxfield/lightfield/geometry.h"

namespace luxfield::hal::sim {

struct FilterPose {
  Vec2 centre;  // of the filter's axis on F, luminaire frame
  int print = 0;
};

struct TraceOptions {
  double delta_m = 0;
  double cell_m = 0;            // size of a u-cell, the filter's knot spacing
  Vec2 cell_origin;             // a corner of some cell
  int u_samples_per_cell = 3;   // per axis
  int s_samples_per_texel = 1;  // per axis; their mean is the texel's value
};

// Part of the lattice an image covers: `width` x `height` texels from (row, column).
struct LatticeWindow {
  int column = 0, row = 0, width = 0, height = 0;
};

using TransmittanceFunction = std::function<double(Vec2 offset_m, int print)>;

// One image per pose and traced channel, float32 rounded once from double sums:
// images[pose][(channel * window.height + row) * window.width + column].
// Every ray (u, s) is traced once for all poses. `half_width_m`: the transmittance is 0 beyond, per
// coordinate. Parallel over the lattice; the result does not depend on the threads.
std::vector<std::vector<float>> TraceIrradiance(
    const Lamp& lamp, const TransmittanceFunction& transmittance, double half_width_m,
    const std::vector<FilterPose>& poses, const lightfield::Lattice& lattice,
    const std::vector<LatticeWindow>& windows, const TraceOptions& options);

}  // namespace luxfield::hal::sim
