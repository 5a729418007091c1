// Lamps in closed form that no basis holds, what filters measure of them and what they light: the
// truth that reconstructions are judged against.
//
// A lamp is a footprint on F, its radius in metres, and a radiance L(u, w) over it,
// w = (s - u) / delta the slopes of the ray. It emits the flux density (docs/theory.md 2)
//
//   E(u->s) = L cos^4(theta) / delta^2
//
// and nothing here knows a basis, a Gram matrix or a texel's width, but for the filters that are
// asked for. Integrals over the footprint are nested Gauss rules of five nodes, cut where knots of
// the filters, borders of facets, the footprint's own and the beam's cut-off lie or cross: good to
// 1e-5.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::planning {

enum class ReferenceLampKind {
  kSquare,     // |u|, |v| < r, Lambertian
  kDisc,       // |u| < r, Lambertian
  kFilament,   // |u| < r / 20, |v| < r, Lambertian
  kRing,       // 4/5 r < |u| < r, Lambertian
  kGaussian,   // exp(-8 |u|^2 / r^2 - 16 |w|^2), |u| < r
  kHeadlight,  // |u| < r; exp(-25 w_x^2 - 123 w_y^2) below w_y = -0.01 + max(0, 0.27 w_x), 0 above
  kFaceted,    // |u| < r; 5 x 5 square facets with beams exp(-278 |w - w_k|^2), |w_k| < 0.18
};

struct ReferenceLamp {
  ReferenceLampKind kind = ReferenceLampKind::kDisc;
  double radius_m = 0;          // r
  lightfield::Vec2 centre_m{};  // of the footprint
  double radiance = 1e5;        // the largest: cd m^-2, or W sr^-1 m^-2

  std::string name() const;  // "square", "disc", ...
  // Half the sides of the footprint's bounding rectangle, m.
  lightfield::Vec2 half_size_m() const;
  // L of the ray that leaves u with slopes w; 0 outside the footprint.
  double Radiance(lightfield::Vec2 u, lightfield::Vec2 w) const;
  // E(u->s) above.
  double FluxDensity(double delta_m, lightfield::Vec2 u, lightfield::Vec2 s) const;
};

// One of each kind.
std::vector<ReferenceLamp> ReferenceLamps(double radius_m, lightfield::Vec2 centre_m = {});

// Irradiance, max(0, n . (u - p)) cut at the horizon node by node:
//
//   E_n(p) = integral L(u->p) max(0, n.(u-p)) z / |u-p|^4 du,   z = p.z > 0
double Irradiance(const ReferenceLamp& lamp, const preprocess::Receiver& receiver);

// integral over F of E(u->s): the flux per area of I at s, which is also the irradiance there.
double FluxDensityOnI(const ReferenceLamp& lamp, double delta_m, lightfield::Vec2 s);

// E_ij(s) = integral E(u->s) Phi_ij(u) du at the middle of every texel, behind filters that are
// exactly the functions of geometry.grid, moved by `displacements_m` (grid.count() of them, or
// none). Every channel is the same; sigma is 0 and the mask empty.
lightfield::Measurements MeasureExactly(const ReferenceLamp& lamp,
                                        const lightfield::LuminaireGeometry& geometry,
                                        std::span<const lightfield::Vec2> displacements_m = {});

// The lamp's projection on the grid, G^-1 E of those filters: the best signed C in the metric of
// L2 over F, and what docs/theory.md 4 solves for as printed.
lightfield::LightField Project(const ReferenceLamp& lamp,
                               const lightfield::LuminaireGeometry& geometry);

// Surface points whose light comes through the lattice from wherever the grid's supports are,
// D = z - delta log-uniform in 0.3 to 30 delta, with horizons that do not cut the supports. Throws
// InputError if the lattice is not larger than the supports.
std::vector<preprocess::Receiver> ReferenceReceivers(const lightfield::LuminaireGeometry& geometry,
                                                     int count, std::uint64_t seed);

}  // namespace luxfield::planning
