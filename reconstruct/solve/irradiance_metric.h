// Non-negative coefficients whose light on receivers is nearest to that of a signed solution
// (docs/theory.md 4, "Non-negative in what receivers see").
//
// A receiver at distance z = delta / (1 - b) that faces the lamp along the axis sees the integral
// of C along the lines s = a + b u (docs/theory.md 7):
//
//   z^2 E_n = delta^2 sum_m integral C_m(a + b u) Phi_m(u) du
//
// Over all such planes, b from 0 (the image plane) to 1 (far away), and all receivers of a plane
//
//   minimise    integral_0^1 db sum_a (L_b dC(a))^2 + w sum_s dC(s)^T G dC(s) / h^2
//   over        C >= 0,  sum_m C_m(s) = sum_m C_0,m(s) at every texel s
//   with        L_b C(a) = sum_m integral C_m(a + b u) Phi_m(u) du / h^2,   dC = C - C_0
//
// a at the middles of the texels, of the lattice and of as much darkness around it as lines cross;
// G the Gram matrix. The first term lets light that C >= 0 cannot have at one texel go to
// neighbours on the same lines; the second is the metric of non_negative.h, to which the solution
// tends for large w. In the second an error of one coefficient weighs w times what it does in the
// first.
//
// The integral over b is a Gauss-Legendre rule of six nodes. Accelerated projected gradient with
// restarts (Nesterov 2004; O'Donoghue, Candes 2015) over all texels together.
#pragma once

#include "luxfield/lightfield/light_field.h"
#include "luxfield/reconstruct/solve/non_negative.h"

namespace luxfield::reconstruct {

struct IrradianceMetricOptions {
  double field_weight = 0.3;  // w, above 0
  // Stop where max |y - P(y - g / d)| <= tolerance max |C_0| at the point y of the last step, g the
  // gradient, d = (1 + w) G_mm / h^2 and P the projection on the feasible set.
  double tolerance = 1e-3;
  int max_iterations = 1000;
};

// Replaces C in place, channel by channel; a texel whose sum is not above 0 becomes 0. All texels
// move, also those without a negative coefficient, but a channel without any stays as it is, to the
// bit. In float32; flux of a texel to 1e-6. `unconverged` counts the pixels of channels that did
// not converge, `moments_lost` is 0: first moments are part of the metric, not kept exactly.
//
// Time: 12 (n/2 h / ds + 2) multiply-adds a coefficient and step, in vectors, n h the width of a
// basis function and ds of a texel. Memory: 8 bytes a coefficient of one channel for the iterates
// and 24 H + 24 bytes a texel of the extended lattice. Throws InputError for C that is not finite
// and options out of range.
NonNegativeSummary ProjectByIrradiance(const IrradianceMetricOptions& options,
                                       lightfield::LightField* field);

}  // namespace luxfield::reconstruct
