// Irradiance in closed form, double precision (docs/theory.md 7.1): what plans, budgets and tests
// are judged by.
//
//   E_n(p) = n . J(p)
//   J(p) = delta^2 / z^3 * sum_m integral_F C_m(s(u)) Phi_m(u) (u - p) du,   z = delta + D
//
// s(u) is where the line from u through p meets I. The integral over F is the one over I of
// docs/theory.md 7 with its variable changed; it is used for every receiver, since it stays regular
// on I, between the planes and far away. Per axis the texels of I are projected to F and integrated
// there exactly, piece by piece between knots.
//
// n is a unit vector and points from the receiver to the lamp side; J points to the lamp (minus
// Gershun's light vector). A receiver on I (D = 0) sees the one texel it lies in; on a texel's
// border, the one with the larger s or the smaller t. Precision: double throughout, about 1e-12 |J|
// for C >= 0.
#pragma once

#include <array>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::lightfield {

struct LightVector {
  std::array<Vec3, 3>
      j{};  // one per channel (1 channel is repeated into all three), W m^-2 or lm m^-2
};

// J(p) of luminaire-frame p, metres; valid for every p with z > 0, zero for z <= 0. Ignores any
// receiver horizon.
LightVector ClosedFormLightVector(const LightField& field, Vec3 p);

// True if a part of the supports on F lies behind the receiver's horizon (the plane through p with
// normal n): then n . J need not be the irradiance.
bool HorizonCutsSupport(const LuminaireGeometry& geometry, Vec3 p, Vec3 n);

// E_n(p) per channel, exact also where the horizon cuts the light: texels on the horizon are
// clipped against it, and the integrand is a polynomial of total degree 5 on each clipped piece. C
// may be negative; E_n >= 0 where C >= 0.
std::array<double, 3> ExactIrradiance(const LightField& field, Vec3 p, Vec3 n);

}  // namespace luxfield::lightfield
