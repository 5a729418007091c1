// What each patch of the filter plane contributes to the light at a receiver: the weights of soft
// shadows (docs/theory.md 7.5).
//
//   B_k(a, tau) = integral over patch k of sum_m C_m(s(u)) Phi_m(u) du,   s(u) = a + (1 - tau) u
//   E_n(p) ~ tau^2 / z sum_k B_k n.(u_k - p),   u_k a point of patch k
//
// with tau = delta / z, a = tau p_xy, and u, a and p_xy counted from the centre of the supports, as
// in light_vector_volume.h. The supports of all images are cut into 4 x 4 equal rectangles. C is
// the luminance of what has three channels. B_k is tabulated over every receiver in front of I that
// sees the images, whatever the scene, and interpolated linearly: it only shares light out among
// the patches, whose sum comes from elsewhere.
//
// Work: that of one light-vector volume of as many nodes. Bytes: 64 per node, 2.4 MB.
//
//   const PatchLight light = TabulatePatchLight(field);
#pragma once

#include <array>
#include <vector>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/preprocess/light_vector_volume.h"

namespace luxfield::preprocess {

// Patches along each side of the supports.
inline constexpr int kPatchesPerSide = 4, kPatches = kPatchesPerSide * kPatchesPerSide;

struct Patch {
  lightfield::Vec2 low, high;  // corners on F, luminaire frame, m
  // Where it is seen from. Those of all patches differ in both coordinates and are evenly spread
  // along both axes (canonical multi-jittered arrangement, Kensler 2013), so that a shadow's edge
  // along an axis passes them one by one.
  lightfield::Vec2 point;
};

// Patch j * kPatchesPerSide + i, i along u.
std::array<Patch, kPatches> PatchesOf(const lightfield::LuminaireGeometry& geometry);

struct PatchLight {
  VolumeAxis tau, a_y, a_x;
  std::vector<float> light;  // [tau][a_y][a_x][patch], W sr^-1 m^-2

  bool IsLit(int patch) const;  // whether any node has light of it
};

// C of any sign.
PatchLight TabulatePatchLight(const lightfield::LightField& field);

}  // namespace luxfield::preprocess
