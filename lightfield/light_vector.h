// Irradiance in closed form, double precision (THEORY.md 7.1): what plans, budgets and tests are judged by.
//
//   E_n(p) = n . J(p),   J(p) = delta^2 / D^3 * sum_m integral_I C_m(s) Phi_m(u(s)) (s - p) ds
//
// n points from the receiver to the lamp side; J points to the lamp (minus Gershun's light vector). For receivers
// behind I (D > 0) the I-plane form is separable per axis; between and on the planes the F-plane form is used.
#pragma once

#include <array>

#include "lightfield/light_field.h"

namespace luxfield::lightfield {

struct LightVector {
  std::array<Vec3, 3> j{};  // one per channel
};

// J(p); valid for every p with z > 0, zero for z <= 0. Ignores any receiver horizon.
LightVector ClosedFormLightVector(const LightField& field, Vec3 p);

// True if the receiver's horizon (plane through p with normal n) cuts, or lies on the lamp's wrong side of, a part
// of the supports on F: then n . J is not the irradiance.
bool HorizonCutsSupport(const LuminaireGeometry& geometry, Vec3 p, Vec3 n);

// E_n(p) >= 0 per channel, exact also where the horizon cuts the light (the cut texels are clipped and integrated
// exactly: the integrand is a polynomial of total degree <= 5 on each clipped piece). C may be negative.
std::array<double, 3> ExactIrradiance(const LightField& field, Vec3 p, Vec3 n);

}  // namespace luxfield::lightfield
