// Moments over F that a solve keeps (docs/theory.md 4, "Flux and moments").
//
// Where the filters are a partition of unity and the lamp lies in the interior cells of the grid,
// sum_i E_i is its flux density at s and sum_i c_i E_i the first moment of it, c_i the filters'
// centres: no projection. Least squares alone loses both at the edge of the grid. Per axis
//
//   A[m][k] = integral u^k Phi_m du,  a[i][0] = 1, a[i][1] = c_i,  X = G^-1 A,  S = A^T X
//   R = G^-1 + X S^-1 (a - X)^T
//
// and C = R_u E R_v^T is the C nearest to G_u^-1 E G_v^-T in the norm of G whose moments are those
// of E.
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/basis.h"
#include "luxfield/lightfield/edge_light.h"

namespace luxfield::reconstruct {

enum class Keep { kNone, kFlux, kMoments };
Keep KeepFromName(const std::string& name);  // "none", "flux", "moments"; InputError on others
std::string KeepName(Keep keep);

constexpr int kMostMoments = 2;  // along an axis

// Moments that are kept along each axis: 0 none, 1 the flux, 2 the first moment too.
struct KeptMoments {
  int u = 0, v = 0;
  bool any() const { return u > 0 || v > 0; }
};

// What `keep` asks for along an axis of `count` functions: nothing where the basis cannot have it
// (no partition of unity) or needs no help (`box`, whose least squares keep the flux), nor where
// the axis has no interior cell, count < n.
int MomentsOfAxis(const lightfield::Basis& basis, int count, Keep keep);

// The same of both axes; nothing across a side that the lamp's light reaches.
KeptMoments MomentsToKeep(const lightfield::BasisGrid& grid, Keep keep,
                          const lightfield::EdgeLight& edges);

// One axis' matrices, count x moments, row-major; u counts from the middle of the supports, in
// spacings, so that columns are alike in size.
struct AxisMoments {
  int count = 0, moments = 0;
  std::vector<double> integrals;  // A, m
  std::vector<double> measured;   // a
};
AxisMoments MomentsAlong(const lightfield::Basis& basis, int count, double spacing_m, int moments);

}  // namespace luxfield::reconstruct
