// A bound on the light that crosses the filter plane but not what is known of I, and so is in no number
// of a light field: as long as no direction beyond the border of I is brighter, from a place on F, than
// the brightest on the border,
//
//   Phi_beyond <= integral_F max_s L(u -> s) (pi - P(u)) du,   s over the border's texels
//
// P(u) the projected solid angle of I as seen from u. Light that passes F by is not bounded: nothing of
// it was seen. The integral is a sum over the cells of F, a midpoint rule of its own size; noise at the
// border makes the bound larger. In the unit of flux, the sum over the fields of a lamp.
#pragma once

#include "luxfield/photometry/lamp.h"

namespace luxfield::photometry {

double FluxBeyondPlanesBound(const Lamp& lamp);

// Of a rectangle on a plane parallel to F at z = delta_m, with edges s0 < s1, t0 < t1 from the place
// (Howell, Menguc and Siegel, configuration factor B-3, of the four rectangles with a corner before the
// place, with their signs, times pi).
double ProjectedSolidAngle(double s0, double s1, double t0, double t1, double delta_m);

}  // namespace luxfield::photometry
